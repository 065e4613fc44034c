"""The arm as lines to be drawn: its joint origins in the robot's base frame, pose by pose."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.planning.capsules import arm_shape
from robocal.planning.cell import Cell
from robocal.robots.robot import Robot

FRAMES_A_MOVE = 10
"""Arms drawn from one pose to the next: enough for the eye."""

Polylines = list[list[list[int]]]


def arm_lines(robot: Robot, cell: Cell, q: Float[Array, "pose joint"]) -> Polylines:
    """Points of the arm from the floor to the target at every pose, in whole millimetres."""
    floor = 0.0 if cell.floor is None else cell.floor
    segments = arm_shape(cell.model(robot), q, floor).segments
    corners = np.stack([segments[0].start, *(segment.end for segment in segments)])
    whole: Polylines = np.rint(np.moveaxis(corners, 2, 0) * 1e3).astype(int).tolist()
    return whole


def on_the_way(q: Float[Array, "pose joint"]) -> Float[Array, "frame joint"]:
    """Poses between the poses, as the joints move when all start and stop together."""
    steps = np.arange(FRAMES_A_MOVE) / FRAMES_A_MOVE
    eased = (1.0 - np.cos(np.pi * steps)) / 2.0
    moves = [start + eased[:, None] * (end - start) for start, end in pairwise(q)]
    return np.concatenate([*moves, q[-1:]])
