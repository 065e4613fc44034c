r"""Start values of base and tool frame in closed form, without any guess.

With nominal flange poses :math:`(R_i, P_i)` in the robot base and unknown base rotation
:math:`B`, the measured positions obey :math:`B^T p_i = P_i + R_i t + s` (`t` the tool point in the
flange, `s` the turned base offset) and the measured orientations
:math:`R_i^T B^T M_i = R_t`. Both are linear in the nine entries of `B`, and `t`, `s`, `R_t`
are eliminated by projection, so what remains is one quadratic form over SO(3), minimised from many
starts at once. It serves full poses (the `A X = Z B` problem), positions alone, and mixtures.

References
----------
.. [1] F. Dornaika, R. Horaud, "Simultaneous robot-world and hand-eye calibration", IEEE T-RA 14(4),
   1998 (the equation A X = Z B).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.frames import nearest_rotation, rotation_from_quaternion
from robocal.identification.problem import Observations
from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import KinematicModel

_GEOMETRY_LENGTH = 1e-3
"""How far a nominal robot misses its position; weighs positions against orientations [m]"""
_GEOMETRY_ANGLE = 2e-3
"""The same for its orientation [rad]"""
_N_STARTS = 400
_N_REFINED = 6
_MAX_ROWS = 600


@dataclass(frozen=True)
class FramesStart:
    """Base in the measuring frame and tool in the flange frame."""

    base: Float[Array, "4 4"]
    tool: Float[Array, "4 4"]


def start_frames(geometry: KinematicModel, rows: Observations) -> FramesStart:
    """Base and tool frames that fit the nominal geometry best.

    Parameters
    ----------
    geometry
        Nominal robot; its own base and tool frames are ignored.
    rows
        Measured rows; at most 600 of them are used, evenly spread.

    Returns
    -------
    FramesStart
        The tool's rotation is the identity where no row has an orientation.
    """
    chosen = np.unique(np.linspace(0, len(rows) - 1, _MAX_ROWS).astype(int))
    bare = KinematicModel(
        geometry.links, geometry.prismatic, mount=geometry.mount, flange=geometry.flange
    )
    T = forward_kinematics(bare, rows.joints[chosen])
    R, P = T[:, :3, :3], T[:, :3, 3]
    p = rows.position[:, chosen].T
    turned = rows.orientation_weight[chosen] > 0
    M = np.moveaxis(rows.axes[:, :, chosen], 2, 0)[turned]

    G, target, eliminated = _position_system(p, P, R)
    A = G.T @ G / _GEOMETRY_LENGTH**2
    b = G.T @ target / _GEOMETRY_LENGTH**2
    if turned.any():
        A += _orientation_form(R[turned], M) / _GEOMETRY_ANGLE**2
    B = _minimise_on_rotations(A, b)

    difference = (p @ B - P).ravel()
    t_s = np.linalg.lstsq(eliminated, difference, rcond=1e-10)[0]
    base, tool = np.eye(4), np.eye(4)
    base[:3, :3], base[:3, 3] = B, B @ t_s[3:]
    tool[:3, 3] = t_s[:3]
    if turned.any():
        tool[:3, :3] = nearest_rotation(
            np.einsum("mji,jk,mkl->il", R[turned], B.T, M) / np.count_nonzero(turned)
        )
    return FramesStart(base, tool)


def _position_system(
    p: Float[Array, "row 3"], P: Float[Array, "row 3"], R: Float[Array, "row 3 3"]
) -> tuple[Float[Array, "scalar 9"], Float[Array, "scalar"], Float[Array, "scalar 6"]]:
    """Rows of B^T p = P with tool point and base offset projected out, and what was projected.

    B is flattened row by row: entry (b, a) multiplies p_b in component a of B^T p.
    """
    n_rows = len(p)
    G = np.zeros((n_rows, 3, 3, 3))
    for a in range(3):
        G[:, a, :, a] = p
    eliminated = np.concatenate([R, np.broadcast_to(np.eye(3), R.shape)], axis=2)
    Z = eliminated.reshape(3 * n_rows, 6)
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


def _minimise_on_rotations(A: Float[Array, "9 9"], b: Float[Array, "9"]) -> Float[Array, "3 3"]:
    """The rotation B with the least vec(B)^T A vec(B) - 2 b^T vec(B), from a spread of starts."""
    quaternions = np.random.default_rng(0).normal(size=(_N_STARTS, 4))
    starts = rotation_from_quaternion(quaternions)
    flat = starts.reshape(-1, 9)
    values = np.einsum("mi,ij,mj->m", flat, A, flat) - 2.0 * flat @ b
    best: Float[Array, "3 3"] = starts[0]
    best_value = np.inf
    for index in np.argsort(values)[:_N_REFINED]:
        B, value = _descend(starts[index], A, b)
        if value < best_value:
            best, best_value = B, value
    return best


def _descend(
    B: Float[Array, "3 3"], A: Float[Array, "9 9"], b: Float[Array, "9"]
) -> tuple[Float[Array, "3 3"], float]:
    """Damped Newton over small turns from the left."""

    def value_of(rotation: Float[Array, "3 3"]) -> float:
        flat = rotation.ravel()
        return float(flat @ A @ flat - 2.0 * b @ flat)

    generators = np.zeros((3, 3, 3))
    for k, (i, j) in enumerate(((2, 1), (0, 2), (1, 0))):
        generators[k, i, j], generators[k, j, i] = 1.0, -1.0
    value, damping = value_of(B), 1e-3
    for _ in range(60):
        L = np.stack([(S @ B).ravel() for S in generators], axis=1)
        gradient = L.T @ (A @ B.ravel() - b)
        hessian = L.T @ A @ L
        size = np.trace(hessian) / 3.0 + 1e-300
        step = -np.linalg.solve(hessian + damping * size * np.eye(3), gradient)
        trial = nearest_rotation((np.eye(3) + np.tensordot(step, generators, 1)) @ B)
        trial_value = value_of(trial)
        if trial_value < value:
            done = value - trial_value < 1e-12 * abs(value)
            B, value, damping = trial, trial_value, max(0.2 * damping, 1e-9)
            if done:
                break
        else:
            damping *= 8.0
            if damping > 1e9:
                break
    return B, value
