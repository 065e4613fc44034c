"""`plan_poses`: what the service asks of any selector behind it."""

import numpy as np
import pytest

from robocal.planning.plan import plan_poses
from robocal.robots.library import load_robot
from tests.elementary_kinematics import Arm, frame, load_arm

TOOL = frame([0.05, 0.03, 0.1, 0.0, 0.0, 0.0])


def log_determinant(arm: Arm, q: np.ndarray, parameters: np.ndarray) -> float:
    """Of the information that positions at `q` hold on some link and frame parameters."""
    columns = []
    n = 5 * len(arm.links)
    for index in parameters:
        step = np.zeros(n + 12)
        step[index] = 1e-5
        pair = [
            Arm(
                arm.links + (sign * step[:n]).reshape(-1, 5), arm.prismatic, arm.limits,
                frame(sign * step[n : n + 6]), TOOL @ frame(sign * step[n + 6 :]),
            ).poses(q)[:, :3, 3].ravel()
            for sign in (1, -1)
        ]  # fmt: skip
        columns.append((pair[0] - pair[1]) / 2e-5)
    return float(np.linalg.slogdet(np.array(columns) @ np.array(columns).T)[1])


@pytest.mark.parametrize(
    ("robot", "count"), [("ur10e", 20), ("staubli_tx60", 15), ("abb_irb910sc", 12)]
)
def test_planned_poses_are_distinct_repeatable_and_within_the_limits(robot, count):
    arm = load_arm(robot)
    q = plan_poses(load_robot(robot), count, seed=3)
    assert q.shape == (count, len(arm.links))
    assert ((q > arm.limits[:, 0]) & (q < arm.limits[:, 1])).all()
    assert len(np.unique(q.round(9), axis=0)) == count
    np.testing.assert_array_equal(plan_poses(load_robot(robot), count, seed=3), q)
    assert not np.array_equal(plan_poses(load_robot(robot), count, seed=4), q)


def test_planned_poses_hold_more_than_random_ones():
    """On 25 parameters that positions determine well, against sets that may cross the floor."""
    arm = load_arm("staubli_tx60")
    base_and_tool_point = range(30, 39)
    absorbed = {*range(5), 6, *range(25, 30)}  # link 1 by the base, link 6 by the tool, d_2 by d_3
    betas = {14, 19, 24}
    links = [k for k in range(30) if k not in absorbed | betas]
    parameters = np.array([*links, *base_and_tool_point])
    planned = log_determinant(arm, plan_poses(load_robot("staubli_tx60"), 30, seed=1), parameters)
    rng = np.random.default_rng(5)
    at_random = [log_determinant(arm, arm.draw(rng, 30), parameters) for _ in range(100)]
    assert np.isfinite(at_random).all()
    assert planned > np.quantile(at_random, 0.95)
