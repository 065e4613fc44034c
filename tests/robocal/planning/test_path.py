from dataclasses import replace

import numpy as np
import pytest

from robocal.kinematics.forward import forward_kinematics
from robocal.planning.candidates import UNBOUND, draw_candidates
from robocal.planning.cell import Box, Cell
from robocal.planning.constraints import CLEARANCES, judge
from robocal.planning.path import path_is_clear
from robocal.robots.library import ROBOTS, load_robot

UP = -np.pi / 2
STRETCHED = np.array([0.0, UP, 0.0, UP, 0.0, 0.0])
FINE = np.linspace(0.0, 1.0, 4001)


@pytest.fixture(scope="module")
def ur10e():
    return load_robot("ur10e")


def kept_on_the_way(robot, cell, start, end):
    """Which of 4,001 readings along the way keep every bound of a posture."""
    q = start + FINE[:, None] * (end - start)
    judged = judge(robot, cell, q)
    return np.all([kept for name, kept in judged.items() if name in CLEARANCES], axis=0)


@pytest.mark.parametrize("name", ROBOTS)
def test_the_check_agrees_with_a_walk_in_thousands_of_steps(name):
    robot = load_robot(name)
    cell = UNBOUND
    q = draw_candidates(robot, 24, np.random.default_rng(5), cell)
    for start, end in zip(q[::2], q[1::2], strict=True):
        check = path_is_clear(robot, start, end, cell)
        kept = kept_on_the_way(robot, cell, start, end)
        if kept.all():
            # A stretch of 1 mm that no fine step met may still be broken; never the reverse.
            assert check.clear or not judge(robot, cell, check.q[None])[check.bound][0]
        else:
            assert not check.clear
            assert check.share <= FINE[np.argmin(kept)] + 1e-3


def test_both_ends_above_the_floor_and_the_way_through_it(ur10e):
    start = np.array([0.0, 0.2, 0.0, UP, 0.0, 0.0])
    end = np.array([0.0, -np.pi - 0.2, 0.0, UP, 0.0, 0.0])
    over = path_is_clear(ur10e, end, STRETCHED, Cell(floor=-3.0))
    assert over.clear
    assert over
    low = path_is_clear(ur10e, STRETCHED, start, Cell(floor=0.0))
    assert low.bound == "floor"
    assert not low
    assert "floor" in low.sentence


def test_the_arm_swings_through_its_own_pedestal(ur10e):
    start = np.array([0.0, UP, 2.2, UP, 0.0, 0.0])
    end = np.array([0.0, UP, -2.2, UP, 0.0, 0.0])
    assert path_is_clear(ur10e, start, end, Cell(floor=None))
    folded = np.array([0.0, UP, 3.1, UP, 0.0, 0.0])
    check = path_is_clear(ur10e, start, folded, Cell(floor=None))
    assert check.bound == "self-collision"
    assert 0.0 < check.share < 1.0
    shown = judge(ur10e, Cell(floor=None), check.q[None])
    assert not shown["self-collision"][0]


def test_the_place_where_the_box_is_left_is_found_to_a_millimetre(ur10e):
    start = np.array([0.0, -0.8, 1.0, -0.2, 0.0, 0.0])
    end = start - np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    model = Cell().model(ur10e)
    at_start = forward_kinematics(model, start[None])[0, :3, 3]
    turned = forward_kinematics(model, end[None])[0, :3, 3]
    wall = 0.5 * (at_start[1] + turned[1])
    low, high = np.minimum(at_start, turned) - 0.5, np.maximum(at_start, turned) + 0.5
    check = path_is_clear(
        ur10e, start, end, Cell(box=Box(tuple(low), (float(high[0]), float(wall), float(high[2]))))
    )
    assert check.bound == "workspace box"
    assert forward_kinematics(model, check.q[None])[0, 1, 3] == pytest.approx(wall, abs=1e-3)


def test_a_short_graze_between_two_clear_ends_is_found(ur10e):
    """A wall 0.05 mm before or behind the farthest point that the target swings to."""
    start = np.array([np.pi - 1.0, -0.8, 1.0, -0.2, 0.0, 0.0])
    end = start + np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    q = start + FINE[:, None] * (end - start)
    reach = forward_kinematics(Cell().model(ur10e), q)[:, 0, 3]
    assert reach.argmax() not in (0, len(q) - 1)
    for short, clear in ((-5e-5, False), (5e-5, True)):
        cell = Cell(box=Box((-3.0, -3.0, -3.0), (float(reach.max() + short), 3.0, 3.0)))
        assert path_is_clear(ur10e, start, end, cell).clear is clear


def test_an_end_beyond_the_joint_limits_is_named(ur10e):
    narrow = replace(ur10e, limits=np.tile([-2.0, 2.0], (6, 1)))
    far = STRETCHED + np.array([2.5, 0, 0, 0, 0, 0])
    check = path_is_clear(narrow, STRETCHED, far)
    assert (check.bound, check.share) == ("joint limits", 1.0)
    assert path_is_clear(narrow, far, STRETCHED).share == 0.0


def test_readings_of_another_robot_are_refused(ur10e):
    with pytest.raises(ValueError, match="6 joints"):
        path_is_clear(ur10e, np.zeros(4), np.zeros(4))
