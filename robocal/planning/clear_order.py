"""An order of visits whose straight moves keep the bounds, as far as there is one.

Judging every pair of poses would take minutes, so only the moves of the present order are judged;
those that break a bound are made expensive, and the order is sought again.
"""

import itertools
from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.planning.cell import Box, Cell
from robocal.planning.order import JointSpeed, shortest_order, travel_times
from robocal.planning.path import path_is_clear
from robocal.robots.robot import Robot

MOST_ROUNDS = 20
_DETOUR = 100.0
"""What a move counts that is not clear; far more than any clear one [s]"""
ROOM = 0.03
"""How much further than necessary planned poses keep from the bounds, so that they can be come to
from either side [m]"""
_SLIMMEST = 4.0
"""A box less than so many times `ROOM` wide is left as it is"""


def clear_order(robot: Robot, cell: Cell, q: Float[Array, "pose joint"]) -> Int[Array, "pose"]:
    """Order of the poses, from the first one on, in which most moves are clear and travel is short.

    An order that is clear already stays as it is.
    """
    times = travel_times(robot.geometry, q, JointSpeed())
    order = np.arange(len(q))
    judged: dict[tuple[int, int], bool] = {}
    best, fewest = order, len(q)
    for _ in range(MOST_ROUNDS):
        pairs = [tuple(sorted((int(a), int(b)))) for a, b in itertools.pairwise(order)]
        blocked = 0
        for a, b in pairs:
            if (a, b) not in judged:
                judged[a, b] = path_is_clear(robot, q[a], q[b], cell).clear
                if not judged[a, b]:
                    times[a, b] = times[b, a] = times[a, b] + _DETOUR
            blocked += not judged[a, b]
        if blocked < fewest:
            best, fewest = order, blocked
        if not blocked:
            break
        order = shortest_order(times)
    return best


def with_room(cell: Cell) -> Cell:
    """The cell a little narrower, for planning."""
    floor = None if cell.floor is None else cell.floor + ROOM
    return replace(cell, floor=floor, box=None if cell.box is None else _narrower(cell.box))


def _narrower(box: Box) -> Box:
    low, high = np.array(box.low), np.array(box.high)
    room = np.where(high - low > _SLIMMEST * ROOM, ROOM, 0.0)
    (x, y, z), (u, v, w) = low + room, high - room
    return Box((float(x), float(y), float(z)), (float(u), float(v), float(w)))
