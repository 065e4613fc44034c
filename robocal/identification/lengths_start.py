r"""Start values where lengths from an anchor are measured, in closed form.

A length obeys :math:`L^2 = |P + R t - c|^2` with the flange pose (R, P), tool point t and anchor c
in the robot base. Expanded it is linear in t, c, the nine products :math:`c_a t_b` and a constant.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.identification.frames_start import FramesStart, nominal_flange
from robocal.identification.observations import Observations
from robocal.kinematics.model import KinematicModel


def start_from_lengths(
    geometry: KinematicModel,
    rows: Observations,
    anchor: Float[Array, "3"],
    axes: Float[Array, "3 3"],
    n_places: int,
) -> FramesStart:
    """Base and tool from lengths alone; the anchor stands where the measuring frame says.

    How the base is turned about the anchor, lengths do not say: it keeps the axes given.
    """
    T = nominal_flange(geometry, rows.joints)
    R, P = T[:, :3, :3], T[:, :3, 3]
    columns = np.concatenate(
        [
            2.0 * np.einsum("mji,mj->mi", R, P),
            -2.0 * P,
            -2.0 * R.reshape(-1, 9),
            np.ones((len(P), 1)),
        ],
        axis=1,
    )
    solved = np.linalg.lstsq(columns, rows.distance**2 - (P**2).sum(axis=1), rcond=1e-10)[0]
    tool, base = np.eye(4), np.eye(4)
    tool[:3, 3] = solved[:3]
    base[:3, :3] = axes
    base[:3, 3] = anchor - axes @ solved[3:6]
    return FramesStart(base, tool, np.tile(solved[:3], (n_places, 1)))


def locate_anchor(points: Float[Array, "row 3"], lengths: Float[Array, "row"]) -> Float[Array, "3"]:
    """The point with these distances from given points, by linear least squares [m]."""
    columns = np.column_stack([-2.0 * points, np.ones(len(points))])
    solved = np.linalg.lstsq(columns, lengths**2 - (points**2).sum(axis=1), rcond=None)[0]
    return np.asarray(solved[:3])
