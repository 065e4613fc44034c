r"""Whether the robot may move straight in its joints from one reading to another.

A path is cut where it is in doubt. Between two readings no point of the arm moves further than

.. math:: L = \sum_i |\Delta q_i|\, r_i,

with :math:`r_i` the length of arm beyond a turning joint (1 for a sliding one). Seen from one part
of the arm another moves no further either, so clearances :math:`c_a, c_b` at both ends leave at
least :math:`(c_a + c_b - L) / 2` in between: where that is positive nothing needs to be looked at.

References
----------
.. [1] F. Schwarzer, M. Saha, J.-C. Latombe, "Adaptive dynamic collision checking for single and
   multiple articulated robots in complex environments", IEEE Trans. Robotics 21(3), 2005.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.kinematics.forward import walk
from robocal.kinematics.model import KinematicModel
from robocal.planning.candidates import UNBOUND
from robocal.planning.cell import Cell
from robocal.planning.constraints import clearances, posed_arm
from robocal.robots.robot import Robot

_FIRST_POINTS = 33
"""Readings looked at before any is in doubt; [1]"""
_RESOLVED = 1e-3
"""Movement of the arm below which a stretch with both ends clear counts as clear [m]"""
_LEVEL = 1e-12
"""One less the cosine of an axis' slope that rounding leaves; [1]"""
_ROUNDING = 1e-9
"""Readings beyond a limit by less stand on it [rad or m]"""


@dataclass(frozen=True)
class PathCheck:
    """Whether a path is clear, and where not; true as a condition exactly where it is clear."""

    bound: str | None
    """The bound that is broken first: `joint limits`, `workspace box`, `floor`,
    `self-collision`."""
    share: float
    """How far along the path that is, from 0 at the start to 1 at the end; 1 if it is clear."""
    q: Float[Array, "joint"]
    """Readings there [rad or m]."""
    sentence: str
    """For the operator."""

    @property
    def clear(self) -> bool:
        """No bound is broken."""
        return self.bound is None

    def __bool__(self) -> bool:
        """Clear."""
        return self.clear


def path_is_clear(
    robot: Robot, start: Float[Array, "joint"], end: Float[Array, "joint"], cell: Cell = UNBOUND
) -> PathCheck:
    """Judge the straight move in joint space, all joints starting and stopping together.

    Parameters
    ----------
    robot
        Its nominal geometry and joint limits; a cell's narrower limits by `replace(robot, ...)`.
    start, end
        Readings [rad or m].
    cell
        Workspace box of the target, floor, link radius. Its tracker does not matter: nothing is
        measured on the way.

    Raises
    ------
    ValueError
        If a reading does not have one value a joint.
    """
    if not start.shape == end.shape == (robot.n_joints,):
        raise ValueError(f"readings {start.shape}, {end.shape}; {robot.n_joints} joints")
    ends = np.array([start, end])
    low, high = robot.limits.T
    beyond = ((ends < low - _ROUNDING) | (ends > high + _ROUNDING)).any(axis=1)
    if beyond.any():
        return _broken("joint limits", float(np.argmax(beyond)), ends)
    ways = _longest_ways(cell.model(robot), ends)
    looked = _look(robot, cell, ends, np.linspace(0.0, 1.0, _FIRST_POINTS))
    while len(doubtful := looked.doubtful(ways)):
        looked = looked.with_more(_look(robot, cell, ends, doubtful))
    first = looked.first_broken
    if first is None:
        return PathCheck(None, 1.0, end, "the path is clear")
    bound = looked.bounds[int(np.argmin(looked.gaps[:, first]))]
    return _broken(bound, float(looked.shares[first]), ends)


@dataclass(frozen=True)
class _Looked:
    """What is known of the path so far, from its start on."""

    bounds: tuple[str, ...]
    shares: Float[Array, "point"]
    gaps: Float[Array, "bound point"]
    """[m]"""

    @property
    def first_broken(self) -> int | None:
        broken = (self.gaps < 0.0).any(axis=0)
        return int(np.argmax(broken)) if broken.any() else None

    def doubtful(self, ways: dict[str, float]) -> Float[Array, "stretch"]:
        """Middles of the stretches that the clearances at their ends leave open.

        Behind the first broken bound nothing matters.
        """
        first = self.first_broken
        known = slice(None) if first is None else slice(first + 1)
        shares, gaps = self.shares[known], self.gaps[:, known]
        longest = np.outer([ways[bound] for bound in self.bounds], np.diff(shares))
        doubt = (gaps[:, :-1] + gaps[:, 1:] < longest) & (longest > _RESOLVED)
        return np.asarray(0.5 * (shares[:-1] + shares[1:])[doubt.any(axis=0)])

    def with_more(self, more: "_Looked") -> "_Looked":
        shares = np.concatenate([self.shares, more.shares])
        order = np.argsort(shares)
        gaps = np.concatenate([self.gaps, more.gaps], axis=1)
        return _Looked(self.bounds, shares[order], gaps[:, order])


def _look(
    robot: Robot, cell: Cell, ends: Float[Array, "2 joint"], shares: Float[Array, "point"]
) -> _Looked:
    q = ends[0] + shares[:, None] * (ends[1] - ends[0])
    gaps = clearances(posed_arm(robot, cell, q))
    return _Looked(tuple(gaps), shares, np.array(list(gaps.values())))


def _longest_ways(model: KinematicModel, ends: Float[Array, "2 joint"]) -> dict[str, float]:
    """Bound, for each bound of a posture, of how far the arm moves towards it [m]."""
    lengths = np.abs(model.links[:, 1:3]).sum(axis=1)
    lengths += np.where(model.prismatic, np.abs(ends).max(axis=0), 0.0)
    beyond = np.cumsum(lengths[::-1])[::-1] + np.linalg.norm(model.tool_frame[:3, 3])
    ways = np.abs(ends[1] - ends[0]) * np.where(model.prismatic, 1.0, beyond)
    # The first joint moves no part against another, and no joint that turns about the vertical
    # moves anything up or down: its axis stays vertical while those before it are.
    _, joints = walk(model, np.zeros((1, model.n_joints)))
    level = np.array([abs(joint.z[2, 0]) > 1.0 - _LEVEL for joint in joints])
    stays_level = np.logical_and.accumulate(level | model.prismatic) & ~model.prismatic
    return {
        "workspace box": float(ways.sum()),
        "floor": float(ways[~stays_level].sum()),
        "self-collision": float(ways[1:].sum()),
    }


def _broken(bound: str, share: float, ends: Float[Array, "2 joint"]) -> PathCheck:
    sentence = f"the straight joint move breaks the {bound} at {share:.0%} of its way"
    return PathCheck(bound, share, ends[0] + share * (ends[1] - ends[0]), sentence)
