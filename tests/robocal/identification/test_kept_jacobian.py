"""The kept Jacobian is always that of the robot asked about."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.identification.kept_jacobian import MOST_ROWS, KeptJacobian
from robocal.kinematics.jacobian import pose_jacobian
from robocal.robots.library import load_robot

ROBOT = load_robot("ur10").geometry
Q = np.random.default_rng(4).uniform(-2.0, 2.0, (30, 6))
ALL = slice(0, len(Q))
CHANGES = {
    "links": replace(ROBOT, links=ROBOT.links + 1e-9),
    "base": replace(ROBOT, base=np.array([0.0, 0.0, 1e-9, 0.0, 0.0, 0.0])),
    "tool": replace(ROBOT, tool=np.array([0.1, 0.0, 0.0, 0.0, 0.0, 0.0])),
    "station": replace(ROBOT, station=np.diag([-1.0, -1.0, 1.0, 1.0])),
    "flange": replace(ROBOT, flange=np.diag([-1.0, -1.0, 1.0, 1.0])),
    "mount": replace(ROBOT, mount=np.diag([-1.0, -1.0, 1.0, 1.0])),
    "prismatic": replace(ROBOT, prismatic=np.array([True, *[False] * 5])),
}


@pytest.mark.parametrize("change", CHANGES)
def test_another_robot_gets_a_jacobian_of_its_own(change):
    kept = KeptJacobian(Q)
    kept.at(ROBOT, ALL)
    target, J = kept.at(CHANGES[change], ALL)
    own_target, own_J = pose_jacobian(CHANGES[change], Q)
    np.testing.assert_array_equal(J, own_J)
    np.testing.assert_array_equal(target.p, own_target.p)


def test_the_same_robot_gets_the_kept_one():
    kept = KeptJacobian(Q)
    _, first = kept.at(ROBOT, ALL)
    _, second = kept.at(ROBOT.with_vector(ROBOT.vector), ALL)
    assert second is first


def test_many_rows_are_computed_block_by_block_and_not_kept():
    q = np.random.default_rng(5).uniform(-2.0, 2.0, (MOST_ROWS + 10, 6))
    kept = KeptJacobian(q)
    block = slice(MOST_ROWS, MOST_ROWS + 10)
    _, J = kept.at(ROBOT, block)
    np.testing.assert_array_equal(J, pose_jacobian(ROBOT, q[block])[1])
    assert kept.at(ROBOT, block)[1] is not J
