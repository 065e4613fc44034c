"""Least squares of many draws of the same rows at once: Gauss-Newton, each draw on its own.

Every draw has its own readings, prior means and start; the rows' joints and weights are shared.
The estimator is that of `identification.least_squares` without its damping, which a start near
the minimum does not need. Draws that do not settle are reported.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.problem import rotation_residual
from robocal.kinematics.forward import Columns
from robocal.uncertainty.many_cells import draws_at_place, many_jacobians, many_targets

_MAX_ITERATIONS = 20
_SETTLED = 1e-9
"""A fit is settled when the next step promises less than this share of a unit of chi-square; [1]"""


@dataclass(frozen=True)
class Readings:
    """What every draw measured; zero where nothing was."""

    position: Float[Array, "3 draw row"]
    """[m]"""
    axes: Float[Array, "3 3 draw row"]
    """Component, axis."""
    distance: Float[Array, "draw row"]
    """[m]"""


@dataclass(frozen=True)
class Estimator:
    """What all draws share.

    Parameters
    ----------
    cell
        Constant frames; where every draw starts.
    rows
        Joints, places and weights; their readings are not used.
    free
        Parameters that move.
    prior_precision
        Of the free parameters [1/m2 or 1/rad2].
    """

    cell: CellModel
    rows: Observations
    free: Int[Array, "free"]
    prior_precision: Float[Array, "free"]


@dataclass(frozen=True)
class ManyFits:
    """Where the draws ended."""

    vectors: Float[Array, "parameter draw"]
    """All parameters of the cell [m, rad]."""
    covariance: Float[Array, "draw free free"]
    """Of the free parameters as each draw's own fit states it, prior included."""
    chi_square: Float[Array, "draw"]
    """Sum of squared whitened residuals, without the prior."""
    settled: Bool[Array, "draw"]


def fit_many(
    estimator: Estimator, readings: Readings, prior_mean: Float[Array, "free draw"]
) -> ManyFits:
    """Fit every draw.

    Parameters
    ----------
    estimator, readings
        As above. Keep draws times rows near two thousand: blocks of that size stay in the cache.
    prior_mean
        Of the free parameters of each draw [m, rad].
    """
    n_draws = prior_mean.shape[1]
    free, precision = estimator.free, estimator.prior_precision
    vectors = np.repeat(estimator.cell.vector[:, None], n_draws, axis=1)
    before = np.full(n_draws, _SETTLED)
    for _ in range(_MAX_ITERATIONS):
        hessian, descent, chi_square = _linearise(estimator, readings, vectors)
        away = vectors[free] - prior_mean
        descent -= (precision[:, None] * away).T
        hessian += np.diag(precision)
        scale = np.sqrt(np.einsum("dff->df", hessian))
        scaled = hessian / (scale[:, :, None] * scale[:, None, :])
        step = np.linalg.solve(scaled, (descent / scale)[:, :, None])[:, :, 0] / scale
        promised = np.einsum("df,df->d", step, descent)
        settled = promised <= _SETTLED
        if settled.all():
            break
        vectors[free] += step.T
        # Where the steps shrink, the next one would promise no more than this one in proportion.
        settled = promised * np.minimum(promised / before, 1.0) <= _SETTLED
        if settled.all():
            break
        before = promised
    inverse = np.linalg.inv(scaled) / (scale[:, :, None] * scale[:, None, :])
    return ManyFits(vectors, inverse, chi_square, settled)


def _linearise(
    estimator: Estimator, readings: Readings, vectors: Float[Array, "parameter draw"]
) -> tuple[Float[Array, "draw free free"], Float[Array, "draw free"], Float[Array, "draw"]]:
    """Hessian, descent direction and chi-square of the data part, draw by draw."""
    n_draws, n_free = vectors.shape[1], len(estimator.free)
    hessian = np.zeros((n_draws, n_free, n_free))
    descent = np.zeros((n_draws, n_free))
    chi_square = np.zeros(n_draws)
    for place, index, group in estimator.rows.by_place:
        J, r = _whitened(estimator, readings, vectors, place, index, group)
        hessian += J @ np.swapaxes(J, 1, 2)
        descent += (J @ r[:, :, None])[:, :, 0]
        chi_square += np.einsum("ds,ds->d", r, r)
    return hessian, descent, chi_square


def _whitened(
    estimator: Estimator,
    readings: Readings,
    vectors: Float[Array, "parameter draw"],
    place: int,
    index: Int[Array, "some"],
    group: Observations,
) -> tuple[Float[Array, "draw free scalar"], Float[Array, "draw scalar"]]:
    """Whitened Jacobian and residual of the rows of one place, a draw in one piece."""
    cell, free = estimator.cell, estimator.free
    n_draws, n_rows = vectors.shape[1], len(group)
    model, mine = draws_at_place(cell, vectors, place)
    targets = many_targets(model, mine, group.joints)
    chosen = _own_columns(cell, place)[free]
    J = many_jacobians(targets)[chosen]
    J[chosen < 0] = 0.0
    parts_J, parts_r = [], []
    if group.has_position:
        weight = np.tile(group.position_weight, n_draws)
        position = readings.position[:, :, index].reshape(3, -1)
        parts_J.append(J[:, :3] * weight)
        parts_r.append((position - targets.target.p) * weight)
    if group.has_orientation:
        weight = np.tile(group.orientation_weight, n_draws)
        axes = readings.axes[:, :, :, index].reshape(3, 3, -1)
        parts_J.append(J[:, 3:] * weight)
        parts_r.append(rotation_residual(axes, targets.target) * weight)
    if group.has_distance:
        weight = np.tile(group.distance_weight, n_draws)
        distance = readings.distance[:, index].ravel()
        along, length = _lengths(cell, vectors, free, targets.target, J, n_rows)
        parts_J.append((along * weight)[:, None])
        parts_r.append(((distance - length) * weight)[None])
    whitened = np.concatenate(parts_J, axis=1).reshape(len(free), -1, n_draws, n_rows)
    residual = np.concatenate(parts_r, axis=0).reshape(-1, n_draws, n_rows)
    by_draw = np.ascontiguousarray(whitened.transpose(2, 0, 1, 3)).reshape(n_draws, len(free), -1)
    return by_draw, residual.transpose(1, 0, 2).reshape(n_draws, -1)


def _own_columns(cell: CellModel, place: int) -> Int[Array, "parameter"]:
    """For each parameter its row in the Jacobian of a place, -1 where it has none."""
    columns, own = cell.columns_at_place(place)
    lookup = np.full(len(cell.names), -1)
    lookup[columns] = own
    return lookup


def _lengths(
    cell: CellModel,
    vectors: Float[Array, "parameter draw"],
    free: Int[Array, "free"],
    target: Columns,
    J: Float[Array, "free 6 column"],
    n_rows: int,
) -> tuple[Float[Array, "free column"], Float[Array, "column"]]:
    """Derivative of the length from the anchor, and the length [m]."""
    anchor = cell.anchor_columns
    away = target.p - np.repeat(vectors[anchor], n_rows, axis=1)
    length = np.linalg.norm(away, axis=0)
    direction = away / length
    along = np.einsum("fic,ic->fc", J[:, :3], direction)
    moves = (free >= anchor.start) & (free < anchor.stop)
    along[moves] = -direction[free[moves] - anchor.start]
    return along, length
