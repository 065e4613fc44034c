r"""How far lengths from an anchor, taken alone, miss the nominal robot.

:math:`L^2 = |P + R t - c|^2` is linear in t, c, their products and a constant. All of these are
free here, which flatters: lengths that miss even so are not of this robot.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.identification.frames_start import nominal_flange
from robocal.kinematics.model import KinematicModel

LEAST_LENGTHS = 30
"""Twice the free numbers, about; fewer are fitted whatever they are"""
_STEPS = 8


def missed_lengths(
    geometry: KinematicModel,
    joints: Float[Array, "row joint"],
    lengths: Float[Array, "row"],
) -> Float[Array, "row"]:
    """Differences between lengths to one target and the nearest that the robot allows [m]."""
    T = nominal_flange(geometry, joints)
    R, P = T[:, :3, :3], T[:, :3, 3]
    t = 2.0 * (P[:, None] @ R)[:, 0]
    design = np.column_stack([t, -2.0 * P, -2.0 * R.reshape(-1, 9), np.ones(len(P))])
    reach = (P**2).sum(axis=1)
    weight, missed = np.ones(len(P)), np.zeros(len(P))
    for _ in range(_STEPS):
        target = (lengths**2 - reach) * weight
        solved = np.linalg.lstsq(design * weight[:, None], target, rcond=1e-10)[0]
        missed = np.abs(np.sqrt(np.maximum(design @ solved + reach, 0.0)) - lengths)
        # Square root of 1 / residual: the median of the rows decides, not a few bad ones.
        level = np.median(missed) + 1e-9
        weight = np.sqrt(level / np.maximum(missed, level))
    return np.asarray(missed)
