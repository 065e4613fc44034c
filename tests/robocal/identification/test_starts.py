"""The closed-form start against a start at the truth: a share of the study in tests/studies."""

import pytest

from tests.studies.starts import ROBOTS, SAME_COST, run_cell


@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("full_pose", [True, False])
def test_no_guess_reaches_the_optimum_that_a_start_at_the_truth_reaches(robot, full_pose):
    for seed in range(4):
        assert run_cell(robot, 5000 + seed, full_pose=full_pose).excess <= SAME_COST
