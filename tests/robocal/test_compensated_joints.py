"""Compensated joints put the real robot, as the oracle computes it, where it was wanted."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.compensation import compensate
from robocal.kinematics.model import KinematicModel
from robocal.reach import Reach
from tests.elementary_kinematics import Arm, load_arm
from tests.measured_cell import true_cell


def model_of(arm: Arm) -> KinematicModel:
    return KinematicModel(arm.links, arm.prismatic, station=arm.base, flange=arm.tool)


@pytest.mark.parametrize("robot", ["staubli_tx60", "ur10e", "abb_irb120"])
def test_the_wanted_pose_is_reached_by_the_true_robot(robot):
    cell = true_cell(robot, 1)
    nominal = cell.nominal.within(cell.true.base, cell.true.tool)
    q = cell.nominal.draw(np.random.default_rng(4), 60, widest=2.0)
    wanted = nominal.poses(q)
    away = np.linalg.norm(cell.true.poses(q)[:, :3, 3] - wanted[:, :3, 3], axis=1)
    found = compensate(model_of(cell.true), wanted, q, cell.nominal.limits)
    reached = np.array([reach is Reach.reached for reach in found.reach])
    assert reached.mean() > 0.8
    got = cell.true.poses(found.q[reached])
    assert away.mean() > 2e-4
    np.testing.assert_allclose(got, wanted[reached], atol=2e-7)
    low, high = cell.nominal.limits.T
    assert ((found.q[reached] >= low) & (found.q[reached] <= high)).all()


def test_a_solution_beyond_the_limits_is_named_and_not_clipped():
    cell = true_cell("ur5e", 2)
    q = cell.nominal.draw(np.random.default_rng(4), 30, widest=2.0)
    wanted = cell.nominal.within(cell.true.base, cell.true.tool).poses(q)
    narrow = np.column_stack([q.min(axis=0) + 0.5, q.max(axis=0) - 0.5])
    model = model_of(cell.true)
    free = compensate(model, wanted, q, cell.nominal.limits)
    bound = compensate(model, wanted, q, narrow)
    beyond = ~((free.q >= narrow[:, 0]) & (free.q <= narrow[:, 1])).all(axis=1)
    assert 5 < beyond.sum() < 30
    for row, outside in enumerate(beyond):
        if free.reach[row] is Reach.reached:
            assert (bound.reach[row] is Reach.reached) == (not outside)


def test_a_pose_out_of_reach_is_named():
    arm = load_arm("ur5e")
    q = np.array([[0.3, -1.0, 1.2, -0.5, 1.0, 0.2]])
    wanted = arm.poses(q)
    wanted[0, :3, 3] += [3.0, 0.0, 0.0]
    found = compensate(model_of(replace(arm)), wanted, q, arm.limits)
    assert found.reach[0] not in (Reach.reached, Reach.outside_limits)
    assert found.position_error[0] > 1.0
