r"""Start values of base, tool and nests in closed form, without any guess.

With nominal flange poses :math:`(R_i, P_i)` in the robot base and unknown base rotation
:math:`B`, the measured positions obey :math:`B^T p_i = P_i + R_i t + s` (`t` the tool point or
nest in the flange, `s` the turned base offset) and the measured orientations
:math:`R_i^T B^T M_i = R_t`. Both are linear in the nine entries of `B`, and all `t`, `s`, `R_t`
are eliminated by projection, so what remains is one quadratic form over SO(3), minimised from many
starts at once. It serves full poses (the `A X = Z B` problem), positions alone, and mixtures.

References
----------
.. [1] F. Dornaika, R. Horaud, "Simultaneous robot-world and hand-eye calibration", IEEE T-RA 14(4),
   1998 (the equation A X = Z B).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.frames import nearest_rotation
from robocal.identification.observations import Observations
from robocal.identification.rotation_search import minimise_on_rotations
from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import KinematicModel

_GEOMETRY_LENGTH = 1e-3
"""How far a nominal robot misses its position; weighs positions against orientations [m]"""
_GEOMETRY_ANGLE = 2e-3
"""The same for its orientation [rad]"""


@dataclass(frozen=True)
class FramesStart:
    """Base in the measuring frame; tool and nests in the flange frame."""

    base: Float[Array, "4 4"]
    tool: Float[Array, "4 4"]
    """Rotation is the identity without orientation rows, place the origin without tool rows."""
    places: Float[Array, "place 3"]
    """Zero for nests without position rows."""


def start_frames(geometry: KinematicModel, rows: Observations, n_places: int = 0) -> FramesStart:
    """Base, tool and nests that fit the nominal geometry best.

    Parameters
    ----------
    geometry
        Nominal robot; its own base and tool frames are ignored.
    rows
        Measured rows with positions among them; of many, some that stand for all are used.
    n_places
        Number of nests on the tool.
    """
    rows = rows.choose(rows.position_weight > 0).representative
    T = nominal_flange(geometry, rows.joints)
    R, P = T[:, :3, :3], T[:, :3, 3]
    p = rows.position.T
    turned = (rows.orientation_weight > 0) & (rows.place < 0)
    M = np.moveaxis(rows.axes, 2, 0)[turned]

    G, target, eliminated = _position_system(p, P, R, rows.place + 1, n_places + 1)
    A = G.T @ G / _GEOMETRY_LENGTH**2
    b = G.T @ target / _GEOMETRY_LENGTH**2
    if turned.any():
        A += _orientation_form(R[turned], M) / _GEOMETRY_ANGLE**2
    B = minimise_on_rotations(A, b)

    difference = (p @ B - P).ravel()
    solved = np.linalg.lstsq(eliminated, difference, rcond=1e-10)[0].reshape(-1, 3)
    base, tool = np.eye(4), np.eye(4)
    base[:3, :3], base[:3, 3] = B, B @ solved[-1]
    tool[:3, 3] = solved[0]
    if turned.any():
        tool[:3, :3] = nearest_rotation(
            np.einsum("mji,jk,mkl->il", R[turned], B.T, M) / np.count_nonzero(turned)
        )
    return FramesStart(base, tool, solved[1:-1])


def nominal_flange(
    geometry: KinematicModel, q: Float[Array, "pose joint"]
) -> Float[Array, "pose 4 4"]:
    """Flange poses of the nominal robot in its own base."""
    bare = KinematicModel(
        geometry.links, geometry.prismatic, mount=geometry.mount, flange=geometry.flange
    )
    return forward_kinematics(bare, q)


def _position_system(
    p: Float[Array, "row 3"],
    P: Float[Array, "row 3"],
    R: Float[Array, "row 3 3"],
    point: Int[Array, "row"],
    n_points: int,
) -> tuple[Float[Array, "scalar 9"], Float[Array, "scalar"], Float[Array, "scalar _"]]:
    """Rows of B^T p = P with all tool points and the base offset projected out, and these columns.

    B is flattened row by row: entry (b, a) multiplies p_b in component a of B^T p.
    """
    n_rows = len(p)
    G = np.zeros((n_rows, 3, 3, 3))
    for a in range(3):
        G[:, a, :, a] = p
    eliminated = np.zeros((n_rows, 3, n_points + 1, 3))
    eliminated[np.arange(n_rows), :, point] = R
    eliminated[:, :, -1] = np.eye(3)
    Z = eliminated.reshape(3 * n_rows, -1)
    U, sigma, _ = np.linalg.svd(Z, full_matrices=False)
    U = U[:, sigma > 1e-9 * sigma[0]]
    flat = G.reshape(3 * n_rows, 9)
    target = P.ravel()
    return flat - U @ (U.T @ flat), target - U @ (U.T @ target), Z


def _orientation_form(
    R: Float[Array, "row 3 3"], M: Float[Array, "row 3 3"]
) -> Float[Array, "9 9"]:
    """Quadratic form of sum |R_i^T B^T M_i - mean|^2 in the entries of B.

    Each map B -> R_i^T B^T M_i is orthogonal on the nine entries, so its square is the identity.
    """
    mean_map = np.einsum("mca,mdb->abdc", R, M).reshape(9, 9) / len(R)
    return np.asarray(len(R) * (np.eye(9) - mean_map.T @ mean_map))
