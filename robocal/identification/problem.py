r"""Whitened residuals of measured rows and their derivatives.

Residual = measured - predicted. For positions and lengths it is the difference over the standard
deviation; for orientations the rotation vector of :math:`R_{measured} R_{predicted}^T` over that of
the orientation.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.frames import rotation_vector
from robocal.identification.cell_model import CellModel
from robocal.identification.kept_jacobian import MOST_ROWS
from robocal.identification.observations import Observations
from robocal.kinematics.forward import Columns, blocks, walk

_NEAR_HALF_TURN = -0.9
"""Cosine below which the sine of the angle no longer gives its direction well; [1]"""
_NO_LENGTH = 1e-12
"""Stands in for a distance of zero, whose direction is undefined [m]"""


@dataclass(frozen=True)
class Residuals:
    """Residuals of every row, zero where nothing was measured."""

    position: Float[Array, "3 row"]
    """[m]"""
    orientation: Float[Array, "3 row"]
    """[rad]"""
    distance: Float[Array, "row"]
    """[m]"""


def residuals(cell: CellModel, rows: Observations) -> Residuals:
    """Measured less predicted, in row order."""
    position, orientation = np.zeros((3, len(rows))), np.zeros((3, len(rows)))
    distance = np.zeros(len(rows))
    for place, index, group in rows.by_place:
        model = cell.at_place(place)
        for block in blocks(len(group)):
            last, _ = walk(model, group.joints[block])
            target = last.then(model.tool_frame)
            there = index[block]
            position[:, there] = group.position[:, block] - target.p
            if group.has_orientation:
                orientation[:, there] = rotation_residual(group.axes[:, :, block], target)
            if group.has_distance:
                distance[there] = group.distance[block] - _length(cell, target)[0]
    return Residuals(
        position * (rows.position_weight > 0),
        orientation * (rows.orientation_weight > 0),
        distance * (rows.distance_weight > 0),
    )


def rotation_residual(axes: Float[Array, "3 3 row"], predicted: Columns) -> Float[Array, "3 row"]:
    r"""Rotation vectors that turn predicted axes onto measured ones [rad].

    With :math:`m_k = R p_k` for the three axes, :math:`\sum_k p_k \times m_k = 2 \sin\vartheta\,n`
    and :math:`\sum_k p_k \cdot m_k = 1 + 2 \cos\vartheta`.
    """
    p = np.stack(np.broadcast_arrays(predicted.x, predicted.y, predicted.z), axis=1)
    sine = 0.5 * np.stack([
        (p[1] * axes[2] - p[2] * axes[1]).sum(axis=0),
        (p[2] * axes[0] - p[0] * axes[2]).sum(axis=0),
        (p[0] * axes[1] - p[1] * axes[0]).sum(axis=0),
    ])
    cosine = 0.5 * ((p * axes).sum(axis=(0, 1)) - 1.0)
    length = np.sqrt((sine * sine).sum(axis=0))
    angle = np.arctan2(length, cosine)
    vector = sine * np.where(length > 1e-12, angle / np.maximum(length, 1e-300), 1.0)
    far = cosine < _NEAR_HALF_TURN
    if far.any():
        turns = np.einsum("ikm,jkm->mij", axes[:, :, far], p[:, :, far])
        vector[:, far] = rotation_vector(turns).T
    return np.asarray(vector)


def _length(cell: CellModel, target: Columns) -> tuple[Float[Array, "_"], Float[Array, "3 _"]]:
    """Distance of the target from the anchor [m], and its direction."""
    if cell.anchor is None:
        raise ValueError("rows with lengths need an anchor")
    away = target.p - cell.anchor[:, None]
    length = np.maximum(np.linalg.norm(away, axis=0), _NO_LENGTH)
    return length, away / length


@dataclass(frozen=True)
class NormalEquations:
    """Half the squared whitened residuals, their gradient and Gauss-Newton Hessian."""

    cost: float
    gradient: Float[Array, "free"]
    hessian: Float[Array, "free free"]


def normal_equations(
    cell: CellModel, rows: Observations, free: Int[Array, "free"]
) -> NormalEquations:
    """Cost, gradient and Hessian over the free parameters, without priors."""
    cost = 0.0
    gradient = np.zeros(len(free))
    hessian = np.zeros((len(free), len(free)))
    for block in whitened_blocks(cell, rows, free):
        cost += 0.5 * float(block.r @ block.r)
        gradient -= block.J @ block.r
        hessian += block.J @ block.J.T
    return NormalEquations(cost, gradient, hessian)


def whitened_jacobian(
    cell: CellModel, rows: Observations, free: Int[Array, "free"]
) -> Float[Array, "scalar free"]:
    """Derivative of the whitened prediction, one line a measured scalar. For few rows."""
    return np.concatenate([block.J for block in whitened_blocks(cell, rows, free)], axis=1).T


@dataclass(frozen=True)
class WhitenedBlock:
    """Some rows of one place, every component of all rows after the other."""

    rows: Int[Array, "row"]
    """Indices of the rows."""
    parts: tuple[tuple[str, slice], ...]
    """What is measured here, with its components of a row: (("position", slice(0, 3)), ...)."""
    J: Float[Array, "free scalar"]
    r: Float[Array, "scalar"]

    @property
    def components(self) -> int:
        """How many scalars a row has here; scalar c of row k stands at c * rows + k."""
        return int(self.parts[-1][1].stop)


def whitened_blocks(
    cell: CellModel, rows: Observations, free: Int[Array, "free"]
) -> Iterator[WhitenedBlock]:
    """Jacobian and residual over the standard deviations, block by block."""
    n_parameters = len(cell.names)
    for place, index, group in rows.by_place:
        columns, own = cell.columns_at_place(place)
        chosen = _chosen_columns(free, columns, own, n_parameters)
        for block in blocks(len(group), MOST_ROWS):
            yield _block(cell, place, group, block, index[block], chosen, free)


def _chosen_columns(
    free: Int[Array, "free"], columns: Array, own: Array, n_parameters: int
) -> Int[Array, "free"]:
    """For each free parameter its row in a place's own Jacobian, -1 where it has none."""
    lookup = np.full(n_parameters, -1)
    lookup[columns] = own
    return np.asarray(lookup[free])


def _block(
    cell: CellModel,
    place: int,
    group: Observations,
    block: slice,
    index: Int[Array, "row"],
    chosen: Int[Array, "free"],
    free: Int[Array, "free"],
) -> WhitenedBlock:
    target, J = group.jacobian.at(cell.at_place(place), block)
    parts: list[tuple[str, slice]] = []
    parts_J, parts_r = [], []
    if group.has_position:
        weight = group.position_weight[block]
        parts.append(("position", slice(0, 3)))
        parts_J.append(J[chosen, :3] * weight)
        parts_r.append((group.position[:, block] - target.p) * weight)
    if group.has_orientation:
        weight = group.orientation_weight[block]
        first = parts[-1][1].stop if parts else 0
        parts.append(("orientation", slice(first, first + 3)))
        parts_J.append(J[chosen, 3:] * weight)
        parts_r.append(rotation_residual(group.axes[:, :, block], target) * weight)
    if group.has_distance:
        weight = group.distance_weight[block]
        length, direction = _length(cell, target)
        along = np.einsum("pim,im->pm", J[chosen, :3], direction)
        first = parts[-1][1].stop if parts else 0
        parts.append(("distance", slice(first, first + 1)))
        parts_J.append((along * weight)[:, None])
        parts_r.append(((group.distance[block] - length) * weight)[None])
    whitened = parts_J[0] if len(parts) == 1 else np.concatenate(parts_J, axis=1)
    residual = parts_r[0] if len(parts) == 1 else np.concatenate(parts_r, axis=0)
    whitened[chosen < 0] = 0.0
    if group.has_distance:
        _fill_anchor(whitened[:, -1], cell.anchor_columns, free, direction * weight)
    J = whitened.reshape(len(free), residual.size)
    return WhitenedBlock(index, tuple(parts), J, residual.ravel())


def _fill_anchor(
    columns: Float[Array, "free row"],
    anchor: slice,
    free: Int[Array, "free"],
    direction: Float[Array, "3 row"],
) -> None:
    """Derivative of the lengths by the anchor: it moves against the target."""
    is_anchor = (free >= anchor.start) & (free < anchor.stop)
    columns[is_anchor] = -direction[free[is_anchor] - anchor.start]
