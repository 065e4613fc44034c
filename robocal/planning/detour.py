r"""A way from where the robot stands to a pose, by straight joint moves that all keep the bounds.

The straight move is taken where it is clear. Where not, one stop is put in between: one of the
postures offered, the one with the least travel first. A robot that already stands beyond a bound
(parked near the floor, say) may leave it: on such a move no broken bound is broken further, and
once all are kept the rest is judged as usual.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.planning.candidates import UNBOUND
from robocal.planning.cell import Cell
from robocal.planning.constraints import clearances, posed_arm
from robocal.planning.path import PathCheck, path_is_clear
from robocal.robots.robot import Robot

MOST_TRIED = 20
"""Stops tried before a pose counts as out of reach"""
_POINTS = 101
"""Readings looked at on the way out of a bound"""
_NO_WORSE = 1e-6
"""Rounding in the comparison of two clearances [m or rad]"""

Joints = Float[Array, "joint"]


@dataclass(frozen=True)
class Way:
    """Where to go one after the other; without stops where there is no way."""

    stops: tuple[Joints, ...]
    """The last one is the pose."""
    check: PathCheck
    """Of the straight move: why there is a detour, or no way."""


def find_way(
    robot: Robot, start: Joints, end: Joints, cell: Cell = UNBOUND, stances: Sequence[Joints] = ()
) -> Way:
    """The straight move, else one over one of the stances, else none.

    Parameters
    ----------
    start, end
        Readings [rad or m].
    stances
        Postures that may serve as a stop.
    """
    check = check_move(robot, start, end, cell)
    if check:
        return Way((end,), check)
    # Where the end itself breaks a bound, or nothing can leave it, no stop helps.
    if not path_is_clear(robot, end, end, cell):
        return Way((), check)
    travel = [float(np.abs(q - start).max() + np.abs(end - q).max()) for q in stances]
    for number in np.argsort(travel, kind="stable")[:MOST_TRIED]:
        stop = stances[int(number)]
        if path_is_clear(robot, stop, end, cell) and check_move(robot, start, stop, cell):
            return Way((stop, end), check)
    return Way((), check)


def check_move(robot: Robot, start: Joints, end: Joints, cell: Cell = UNBOUND) -> PathCheck:
    """Judge a straight move that may begin beyond a bound, if it leads out of it."""
    check = path_is_clear(robot, start, end, cell)
    if check or path_is_clear(robot, start, start, cell):
        return check
    shares = np.linspace(0.0, 1.0, _POINTS)
    q = start + shares[:, None] * (end - start)
    gaps = np.array([*_limit_gaps(robot, q), *clearances(posed_arm(robot, cell, q)).values()])
    kept = (gaps >= 0.0).all(axis=0)
    if not kept.any():
        return check
    out = int(np.argmax(kept))
    beyond = np.minimum(gaps[:, : out + 1], 0.0)
    if (np.diff(beyond, axis=1) < -_NO_WORSE).any():
        return check
    return path_is_clear(robot, q[out], end, cell)


def _limit_gaps(robot: Robot, q: Float[Array, "pose joint"]) -> list[Float[Array, "pose"]]:
    """How far every joint is within its limits [rad or m]."""
    low, high = robot.limits.T
    return list(np.minimum(q - low, high - q).T)
