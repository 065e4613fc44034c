"""What too few poses leave open, against counting numbers and against a joint that stood still."""

import numpy as np

from robocal.planning.candidates import draw_candidates
from robocal.planning.open_parameters import open_parameters
from robocal.robots.library import load_robot

ROBOT = load_robot("ur10e")
POSES = draw_candidates(ROBOT, 40, np.random.default_rng(5))


def test_many_poses_leave_nothing_open():
    for sees_orientation in (False, True):
        assert open_parameters(ROBOT, POSES, sees_orientation=sees_orientation) == ()


def test_few_poses_tell_no_more_parameters_than_they_give_numbers():
    every = len(open_parameters(ROBOT, POSES[:0], sees_orientation=True))
    assert every == 4 * 6 + 6
    for count in (1, 2, 4):
        left = len(open_parameters(ROBOT, POSES[:count], sees_orientation=True))
        assert left >= every - 6 * count
        assert left < every


def test_a_joint_that_stood_still_is_named():
    still = POSES.copy()
    still[:, 3] = 0.3
    names = open_parameters(ROBOT, still, sees_orientation=True)
    assert names
    assert any(name.endswith(("_3", "_4")) for name in names)
