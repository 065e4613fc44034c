from dataclasses import replace

import numpy as np
import pytest

from robocal.errors import BadInput, NoAnswer
from robocal.kinematics.forward import forward_kinematics
from robocal.planning.candidates import REMEDIES, draw_candidates
from robocal.planning.cell import Box, Cell, Station
from robocal.planning.constraints import CONSTRAINTS, judge
from robocal.robots.library import ROBOTS, load_robot

STATION = Station((2.5, 0.5, 0.6), 1.5, 3.2, (0.0, 0.0, 1.0), np.radians(40))
CELL = Cell(box=Box((0.2, -0.5, 0.1), (0.9, 0.5, 0.9)), station=STATION)


@pytest.fixture(scope="module")
def ur10e():
    return load_robot("ur10e")


@pytest.mark.parametrize("name", ROBOTS)
def test_every_robot_of_the_library_has_poses_above_its_floor(name):
    robot = load_robot(name)
    q = draw_candidates(robot, 30, np.random.default_rng(1))
    assert q.shape == (30, robot.n_joints)
    assert ((q > robot.limits[:, 0]) & (q < robot.limits[:, 1])).all()
    assert (forward_kinematics(Cell().model(robot), q)[:, 2, 3] > 0).all()


def test_candidates_keep_box_range_and_acceptance(ur10e):
    q = draw_candidates(ur10e, 100, np.random.default_rng(1), CELL)
    T = forward_kinematics(CELL.model(ur10e), q)
    position, looking = T[:, :3, 3], T[:, :3, 2]
    assert (position >= CELL.box.low).all()
    assert (position <= CELL.box.high).all()
    towards = np.array(STATION.position) - position
    ranges = np.linalg.norm(towards, axis=1)
    assert ranges.min() >= 1.5
    assert ranges.max() <= 3.2
    cosine = (towards * looking).sum(axis=1) / ranges
    assert cosine.min() >= np.cos(np.radians(40)) - 1e-12


def test_the_same_seed_draws_the_same_candidates(ur10e):
    one, other = (draw_candidates(ur10e, 50, np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(one, other)


@pytest.mark.parametrize(
    ("cell", "culprit"),
    [
        (Cell(box=Box((5.0, 5.0, 5.0), (6.0, 6.0, 6.0))), "workspace box"),
        (Cell(floor=3.0), "floor"),
        (replace(CELL, box=None, station=replace(STATION, farthest=1.6)), "tracker range"),
        (replace(CELL, box=None, station=replace(STATION, acceptance=1e-4)), "target acceptance"),
    ],
)
def test_an_infeasible_request_names_the_bound_that_removes_most(ur10e, cell, culprit):
    with pytest.raises(NoAnswer, match=r"are allowed: ([a-z -]+) removes") as refusal:
        draw_candidates(ur10e, 20, np.random.default_rng(1), cell)
    assert f"are allowed: {culprit} removes" in str(refusal.value)
    assert str(refusal.value).endswith(f"Most is removed by {culprit}: {REMEDIES[culprit]}")


def test_there_is_a_remedy_for_every_bound():
    assert REMEDIES.keys() == set(CONSTRAINTS)


def test_the_counts_of_an_infeasible_request_add_up(ur10e):
    cell = Cell(box=Box((5.0, 5.0, 5.0), (6.0, 6.0, 6.0)))
    with pytest.raises(NoAnswer, match=r"of 20000 random poses .* only 0 .* box removes 20000 "):
        draw_candidates(ur10e, 20, np.random.default_rng(1), cell)


def test_a_box_without_inside_is_bad_input(ur10e):
    cell = Cell(box=Box((0.0, 0.0, 0.5), (1.0, 1.0, 0.5)))
    with pytest.raises(BadInput, match="lower corner"):
        draw_candidates(ur10e, 5, np.random.default_rng(1), cell)


def test_only_bounds_that_the_cell_states_are_judged(ur10e):
    q = np.zeros((1, 6))
    assert set(judge(ur10e, CELL, q)) == set(CONSTRAINTS)
    assert set(judge(ur10e, Cell(floor=None), q)) == {"self-collision"}
