r"""The order of visits with little travel time: nearest next, then better by reversals and moves.

A joint move takes as long as its slowest joint, each with a trapezoidal speed:
:math:`t = |\Delta q| / v + v / a`, or :math:`2\sqrt{|\Delta q| / a}` where v is not reached.

References
----------
.. [1] G. A. Croes, Operations Research 6(6), 1958 (2-opt); I. Or, thesis, 1976 (Or-opt).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.kinematics.model import KinematicModel

_LEAST_GAIN = 1e-9
"""[s]"""
_LONGEST_MOVED = 3
"""Visits that an Or-opt step moves together"""


@dataclass(frozen=True)
class JointSpeed:
    """How fast every joint may go."""

    turning: float = 1.0
    """[rad/s]"""
    turning_acceleration: float = 2.0
    """[rad/s2]"""
    sliding: float = 0.25
    """[m/s]"""
    sliding_acceleration: float = 1.0
    """[m/s2]"""


def travel_times(
    model: KinematicModel, q: Float[Array, "pose joint"], speed: JointSpeed
) -> Float[Array, "pose pose"]:
    """Time of the joint move between every two poses [s]."""
    v = np.where(model.prismatic, speed.sliding, speed.turning)
    a = np.where(model.prismatic, speed.sliding_acceleration, speed.turning_acceleration)
    times = np.zeros((len(q), len(q)))
    for column, joint_v, joint_a in zip(q.T, v, a, strict=True):
        way = np.abs(column[:, None] - column[None, :])
        long = way > joint_v**2 / joint_a
        np.maximum(
            times,
            np.where(long, way / joint_v + joint_v / joint_a, 2.0 * np.sqrt(way / joint_a)),
            out=times,
        )
    return times


def shortest_order(times: Float[Array, "pose pose"], start: int = 0) -> Int[Array, "pose"]:
    """An order of visits, from `start` on, that no reversal and no short move makes shorter."""
    order = _nearest_next(times, start)
    while _reverse_once(order, times) or _move_once(order, times):
        pass
    return order


def duration(order: Int[Array, "visit"], times: Float[Array, "pose pose"]) -> float:
    """Travel time of an order of visits [s]."""
    return float(times[order[:-1], order[1:]].sum())


def _nearest_next(times: Float[Array, "pose pose"], start: int) -> Int[Array, "pose"]:
    left = np.ones(len(times), dtype=bool)
    order = np.empty(len(times), dtype=int)
    here = start
    for position in range(len(times)):
        order[position] = here
        left[here] = False
        if left.any():
            here = int(np.argmin(np.where(left, times[here], np.inf)))
    return order


def _reverse_once(order: Int[Array, "pose"], times: Float[Array, "pose pose"]) -> bool:
    """Reverse the stretch whose reversal gains most; False if none gains."""
    n = len(order)
    if n < 3:
        return False
    among = times[np.ix_(order, order)]
    along = among[np.arange(n - 1), np.arange(1, n)]
    # Reversing i .. j joins i-1 to j and i to j+1; a last stretch has no j+1.
    after = np.append(along[1:], 0.0)
    joined = np.zeros((n - 1, n - 1))
    joined[:, :-1] = among[1:, 2:]
    gain = along[:, None] + after[None, :] - among[:-1, 1:] - joined
    gain[np.tril_indices(n - 1)] = 0.0
    i, j = np.unravel_index(np.argmax(gain), gain.shape)
    if gain[i, j] < _LEAST_GAIN:
        return False
    order[i + 1 : j + 2] = order[i + 1 : j + 2][::-1].copy()
    return True


def _move_once(order: Int[Array, "pose"], times: Float[Array, "pose pose"]) -> bool:
    """Move a few visits elsewhere, where it gains most; False if none gains."""
    n = len(order)
    for length in range(1, min(_LONGEST_MOVED, n - 2) + 1):
        for first in range(1, n - length + 1):
            stretch = order[first : first + length]
            rest = np.concatenate([order[:first], order[first + length :]])
            freed = times[order[first - 1], stretch[0]]
            if first + length < n:
                freed += times[stretch[-1], order[first + length]]
                freed -= times[order[first - 1], order[first + length]]
            cost = times[rest, stretch[0]].copy()
            cost[:-1] += times[stretch[-1], rest[1:]] - times[rest[:-1], rest[1:]]
            place = int(np.argmin(cost))
            if freed - cost[place] > _LEAST_GAIN:
                order[:] = np.concatenate([rest[: place + 1], stretch, rest[place + 1 :]])
                return True
    return False
