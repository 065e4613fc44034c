"""How much of a hidden effect data can show: what survives projection out of the geometry.

Everything by finite differences of the true cell's own kinematics. The length of the surviving
part, over the noise, is Lambda; its root mean square per coordinate is the signal-to-noise ratio.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.emulators.hidden_cell import HiddenCell
from drivers.emulators.rigid import Matrix, small_motion
from drivers.emulators.stance import Circumstances
from drivers.emulators.true_arm import LinkTable, Vector, link_frames

STEP = 1e-6
"""Of a parameter, either side [m], [rad]."""
UNMOVED = np.eye(4)
SAME = 1e-6
"""Directions whose singular value is less than this part of the largest are numerical dust; [1]"""
NEARLY_PARALLEL = 0.1
"""Below this |sin(alpha)| the axes of a link count as parallel, and beta as a parameter; [1]"""


@dataclass(frozen=True)
class Sigma:
    """Noise of a reading, per axis; orientation None where it is not read."""

    position: float
    """[m]"""
    orientation: float | None
    """[rad]"""


def apart(T: Matrix, T_other: Matrix, seen: Vector, seen_other: Vector, sigma: Sigma) -> Vector:
    """Differences of two stacks of readings in units of noise, one line a row."""
    parts = [(seen - seen_other) / sigma.position]
    if sigma.orientation is not None:
        R = T[..., :3, :3] @ np.swapaxes(T_other[..., :3, :3], -1, -2)
        skew = 0.5 * (R - np.swapaxes(R, -1, -2))
        turn = np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)
        parts.append(turn / sigma.orientation)
    return np.concatenate(parts, axis=1)


def geometry_basis(cell: HiddenCell, q: Vector, sigma: Sigma) -> Vector:
    """Orthonormal columns of everything that links, base and tool can explain."""
    links, _ = link_columns(cell, q, sigma)
    return orthonormal(np.concatenate([links, frame_columns(cell, q, sigma)], axis=1))


def orthonormal(J: Vector) -> Vector:
    """Return a basis of what these columns span."""
    length = np.linalg.norm(J, axis=0)
    J = J[:, length > 0.0] / length[length > 0.0]
    U, singular, _ = np.linalg.svd(J, full_matrices=False)
    return np.asarray(U[:, singular > SAME * singular[0]])


def link_columns(cell: HiddenCell, q: Vector, sigma: Sigma) -> tuple[Vector, NDArray[np.bool_]]:
    """Derivatives by the links' parameters, and which of these are angles [1/m], [1/rad]."""
    names = [
        (name, joint)
        for name in ("theta", "d", "a", "alpha", "beta")
        for joint in range(cell.table.n_joints)
        if name != "beta" or abs(np.sin(cell.table.alpha[joint])) < NEARLY_PARALLEL
    ]
    columns = []
    for name, joint in names:
        more, less = (_moved(cell.table, name, joint, step) for step in (STEP, -STEP))
        columns.append(_column(_poses(cell, q, more), _poses(cell, q, less), sigma))
    return np.stack(columns, axis=1), np.array([name not in {"d", "a"} for name, _ in names])


def frame_columns(cell: HiddenCell, q: Vector, sigma: Sigma) -> Vector:
    """Derivatives by shifts and turns of base and tool [1/m], [1/rad]."""
    columns, table, eye = [], cell.table, UNMOVED
    for axis in np.eye(3) * STEP:
        for motion in (small_motion(axis, np.zeros(3)), small_motion(np.zeros(3), axis)):
            back = np.asarray(np.linalg.inv(motion), dtype=np.float64)
            for before, after in (((motion, eye), (back, eye)), ((eye, motion), (eye, back))):
                there, other = (_poses(cell, q, table, *pair) for pair in (before, after))
                columns.append(_column(there, other, sigma))
    return np.stack(columns, axis=1)


def _poses(
    cell: HiddenCell,
    q: Vector,
    table: LinkTable,
    before: Matrix = UNMOVED,
    after: Matrix = UNMOVED,
) -> Matrix:
    return np.asarray(cell.base @ before @ link_frames(table, q)[-1] @ cell.tool @ after)


def _column(T_plus: Matrix, T_minus: Matrix, sigma: Sigma) -> Vector:
    found = apart(T_plus, T_minus, T_plus[..., :3, 3], T_minus[..., :3, 3], sigma)
    return np.asarray(found.ravel() / (2.0 * STEP))


def _moved(table: LinkTable, name: str, joint: int, step: float) -> LinkTable:
    values = getattr(table, name).copy()
    values[joint] += step
    return replace(table, **{name: values})


@dataclass(frozen=True)
class Visibility:
    """What survives of one effect."""

    snr: float
    """Root mean square per coordinate over the noise; [1]"""
    strength: float
    """Lambda, its length over the noise; [1]"""
    raw: float
    """Length before projection; [1]"""


def visibility(difference: Vector, basis: Vector, rows: NDArray[np.bool_]) -> Visibility:
    """What these rows show of a difference between two cells, see `apart`."""
    x = difference[rows].ravel()
    left = x - basis @ (basis.T @ x)
    strength = float(np.linalg.norm(left))
    return Visibility(strength / float(np.sqrt(len(x))), strength, float(np.linalg.norm(x)))


def difference(
    cell: HiddenCell, without: HiddenCell, q: Vector, now: Circumstances, sigma: Sigma
) -> Vector:
    """Return what all rows read of one cell less what they would read of the other."""
    still = np.zeros_like(q)
    T, T_without = cell.target_pose(q, now, still), without.target_pose(q, now, still)
    return apart(T, T_without, cell.seen(T), without.seen(T_without), sigma)
