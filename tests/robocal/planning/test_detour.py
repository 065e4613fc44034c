"""Ways round what is in the way, on the UR10e over its own floor."""

import itertools
from dataclasses import replace

import numpy as np

from robocal.planning.cell import Box, Cell
from robocal.planning.detour import check_move, find_way
from robocal.planning.path import path_is_clear
from robocal.robots.library import load_robot

ROBOT = load_robot("ur10e")
DEG = np.pi / 180
UPRIGHT = np.array([0, -90, 0, -90, 0, 0]) * DEG
LEFT = np.array([90, -60, 90, -90, -90, 0]) * DEG
RIGHT = np.array([-90, -60, 90, -90, -90, 0]) * DEG
LEANING_BACK = np.array([0, -120, 30, -90, -90, 0]) * DEG
BEHIND = np.array([180, -60, 90, -90, -90, 0]) * DEG
NARROW = Cell(box=Box((-0.65, -2.0, 0.0), (2.0, 2.0, 3.0)))
STRETCHED = np.zeros(6)
"""The wrist hangs below the floor's margin."""


def test_a_clear_move_is_made_straight():
    way = find_way(ROBOT, UPRIGHT, LEFT)
    assert [stop.tolist() for stop in way.stops] == [LEFT.tolist()]


def test_a_blocked_move_goes_over_the_stance_that_is_clear():
    """From left to right the target swings 0.77 m out; over the arm leaning back it does not."""
    assert not path_is_clear(ROBOT, LEFT, RIGHT, NARROW)
    way = find_way(ROBOT, LEFT, RIGHT, NARROW, [BEHIND, LEANING_BACK])
    assert len(way.stops) == 2
    np.testing.assert_array_equal(way.stops[0], LEANING_BACK)
    legs = [LEFT, *way.stops]
    for start, end in itertools.pairwise(legs):
        assert path_is_clear(ROBOT, start, end, NARROW)


def test_without_a_stance_there_is_no_way_and_the_bound_is_named():
    way = find_way(ROBOT, LEFT, RIGHT, NARROW)
    assert way.stops == ()
    assert way.check.bound == "workspace box"


def test_a_pose_below_the_floor_has_no_way_whatever_the_stances():
    way = find_way(ROBOT, UPRIGHT, STRETCHED, Cell(), [LEFT, RIGHT])
    assert way.stops == ()
    assert way.check.bound == "floor"


def test_a_robot_parked_too_low_may_rise_but_not_sink():
    assert not path_is_clear(ROBOT, STRETCHED, UPRIGHT)
    assert check_move(ROBOT, STRETCHED, UPRIGHT)
    lower = STRETCHED.copy()
    lower[1] = 20 * DEG
    sinking = check_move(ROBOT, STRETCHED, lower)
    assert not sinking
    assert sinking.bound == "floor"


def test_a_joint_beyond_a_narrowed_limit_may_come_back_but_not_go_on():
    narrow = ROBOT.limits.copy()
    narrow[0] = -1.0, 1.0
    robot = replace(ROBOT, limits=narrow)
    outside = UPRIGHT.copy()
    outside[0] = 1.2
    assert check_move(robot, outside, UPRIGHT)
    further = UPRIGHT.copy()
    further[0] = 1.3
    assert not check_move(robot, outside, further)
