"""Which parameters a set of poses leaves open that well-spread poses would determine."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.planning.candidates import draw_candidates
from robocal.planning.cell import Cell
from robocal.planning.pose_rows import pose_rows
from robocal.robots.robot import Robot

_WELL_SPREAD = 60
"""Random poses that determine all that can be determined"""


def open_parameters(
    robot: Robot, q: Float[Array, "pose joint"], *, sees_orientation: bool
) -> tuple[str, ...]:
    """Names of the parameters that these poses cannot tell from others, and others can.

    Parameters
    ----------
    q
        Readings that were measured [rad or m]; none at all leaves everything open.
    sees_orientation
        Whether the instrument reads full poses.
    """
    cell = replace(Cell(floor=None), sees_orientation=sees_orientation)
    rng = np.random.default_rng(_WELL_SPREAD)
    known = pose_rows(robot, cell, draw_candidates(robot, _WELL_SPREAD, rng, cell)).names
    if not len(q):
        return known
    told = set(pose_rows(robot, cell, q).names)
    return tuple(name for name in known if name not in told)
