"""Rows judged again once causes are in the model.

To the geometry alone the rows that a strong cause moves most look like outliers: with the cause
they fit, and speak for it.
"""

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array
from scipy.special import gammaincc, gammaincinv

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.joint_fit import JointFit, effect_columns, whitened_residual
from robocal.diagnosis.linearised import linearise
from robocal.identification.observations import Observations
from robocal.identification.outliers import RowScores, robust_scale
from robocal.identification.solve import scaled_inverse


def score_again(
    found: JointFit, measured: Observations, around: Circumstances, used: Bool[Array, "row"]
) -> RowScores:
    """Score every row, all its parts together, against geometry and effects.

    Parameters
    ----------
    found
        The model.
    measured, around
        Rows, row for row the same.
    used
        Those that the model was fitted to.
    """
    base = linearise(found.cell, measured, found.fit.free, found.fit.prior_precision)
    instances = tuple(fitted.instance for fitted in found.effects)
    A = np.concatenate([base.W[base.free].T, effect_columns(base, around, instances)[0]], axis=1)
    r = whitened_residual(found.cell, measured, around, found.effects)
    # The covariance at this very place: else a row's share in the fit may exceed one.
    took_part = A[used[base.row]]
    covariance = scaled_inverse(took_part.T @ took_part + np.diag(found.fit.precision))
    spread = A @ np.linalg.cholesky(covariance)
    there = (base.W != 0.0).any(axis=0)
    edges = np.append(base.first_scalar, len(r))
    squares, counts = np.zeros(len(measured)), np.zeros(len(measured))
    for row in range(len(measured)):
        here = np.arange(edges[row], edges[row + 1])[there[edges[row] : edges[row + 1]]]
        own = np.eye(len(here)) * (1.0 + 1e-9)
        own += (-1.0 if used[row] else 1.0) * spread[here] @ spread[here].T
        squares[row], counts[row] = r[here] @ np.linalg.solve(own, r[here]), len(here)
    half_nu = counts / 2.0
    seen = counts > 0
    median = np.where(seen, 2.0 * gammaincinv(np.maximum(half_nu, 0.5), 0.5), 1.0)
    scale = robust_scale((squares / median)[None], (seen & used)[None])
    chance = np.where(seen, gammaincc(np.maximum(half_nu, 0.5), squares / scale**2 / 2.0), 1.0)
    return RowScores(np.sqrt(squares) / scale, chance, scale)
