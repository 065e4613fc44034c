r"""Rows that do not belong: residuals judged against their own leverage.

With whitened residual r and Jacobian A of a row and the Hessian H of the fit, the residual of a
good row that took part has covariance :math:`I - A H^{-1} A^T`, of one that did not
:math:`I + A H^{-1} A^T`; so :math:`t^2 = r^T (I \mp A H^{-1} A^T)^{-1} r` follows chi-square. Where
the model leaves more than the declared noise, the median sets the scale and only gross errors
count. Position, orientation and length of a row are judged each on its own.

References
----------
.. [1] R. D. Cook, S. Weisberg, *Residuals and Influence in Regression*, Chapman and Hall, 1982.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.special import gammaincc, gammaincinv

from robocal.formats.bundle import RejectedRow
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.problem import WhitenedBlock, whitened_blocks

REJECT = 1.5e-3
"""Chance of a good row to be rejected where the model is adequate; [1]"""
REJECT_GROSS = 1e-9
"""The same where it is not and the scale comes from the residuals themselves; [1]"""
_PARTS = ("position", "orientation", "distance")
_ADEQUATE_SCALE = 1.3
"""Robust standard deviation, in declared ones, above which the model counts as inadequate; [1]"""


@dataclass(frozen=True)
class RowScores:
    """How far each row is off, in standard deviations of its own residual."""

    sigmas: Float[Array, "row"]
    """Root of t squared over the scale."""
    chance: Float[Array, "row"]
    """Probability of a good row to be off so far."""
    scale: float
    """Standard deviation of the residuals in declared ones, 1 where the model is adequate."""

    @property
    def outlying(self) -> Bool[Array, "row"]:
        """Rows to reject."""
        return np.asarray(self.chance < (REJECT if self.scale == 1.0 else REJECT_GROSS))


def score_rows(
    cell: CellModel,
    rows: Observations,
    free: Int[Array, "free"],
    covariance: Float[Array, "free free"],
    used: Bool[Array, "row"],
    scale: float | None = None,
) -> RowScores:
    """Score every row of `rows`, of which those in `used` took part in the fit.

    Parameters
    ----------
    cell
        The fitted cell.
    free, covariance
        Parameters that moved, and their covariance.
    scale
        Standard deviation of the residuals in declared ones; from the used rows if None.
    """
    return score_blocks(whitened_blocks(cell, rows, free), rows, covariance, used, scale)


def score_blocks(
    blocks: Iterable[WhitenedBlock],
    rows: Observations,
    covariance: Float[Array, "unknown unknown"],
    used: Bool[Array, "row"],
    scale: float | None = None,
) -> RowScores:
    """Like `score_rows`, from the derivatives by all unknowns, of which `covariance` is."""
    squares = np.zeros((len(_PARTS), len(rows)))
    root = np.linalg.cholesky(covariance)
    for block in blocks:
        n = len(block.rows)
        spread = (root.T @ block.J).reshape(len(root), block.components, n)
        sign = np.where(used[block.rows], -1.0, 1.0)[:, None, None]
        r = block.r.reshape(block.components, n).T
        for part, components in block.parts:
            arm = spread[:, components]
            own = np.eye(arm.shape[1]) + sign * np.einsum("acm,adm->mcd", arm, arm)
            # A row that alone determines a parameter has no residual of its own to judge.
            own += 1e-9 * np.eye(arm.shape[1])
            off = r[:, components]
            scaled = np.linalg.solve(own, off[:, :, None])[:, :, 0]
            squares[_PARTS.index(part), block.rows] = (off * scaled).sum(axis=1)
    weights = (rows.position_weight, rows.orientation_weight, rows.distance_weight)
    there = np.stack(weights) > 0
    half_nu = np.array([1.5, 1.5, 0.5])[:, None]
    if scale is None:
        scale = _robust_scale(squares / gammaincinv(half_nu, 0.5) / 2.0, there & used)
    chances = np.where(there, gammaincc(half_nu, squares / scale**2 / 2.0), 1.0)
    # The worst of several parts is judged, so its chance counts as often as there are parts.
    chance = np.minimum(1.0, chances.min(axis=0) * np.maximum(there.sum(axis=0), 1))
    return RowScores(np.sqrt(squares.max(axis=0)) / scale, chance, scale)


def is_settled(used: Bool[Array, "row"], before: Bool[Array, "row"]) -> bool:
    """Whether a round left the choice of rows as it was, or so few that it is none."""
    return bool((used == before).all() or used.sum() * 2 < len(used))


def named_outliers(
    lines: Int[Array, "row"], scores: RowScores, which: Bool[Array, "row"]
) -> tuple[RejectedRow, ...]:
    """Some rows by their lines of the file, each with how far it is off."""
    return tuple(
        RejectedRow(int(lines[row]), f"outlier, {scores.sigmas[row]:.1f} sigma")
        for row in np.flatnonzero(which)
    )


def _robust_scale(ratio: Float[Array, "part row"], judged: Bool[Array, "part row"]) -> float:
    """Median of the squares over chi-square's median; 1 where that is the declared noise."""
    if not judged.any():
        return 1.0
    scale = float(np.sqrt(np.median(ratio[judged])))
    return scale if scale > _ADEQUATE_SCALE else 1.0
