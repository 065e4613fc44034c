r"""The fit at its minimum, as linear algebra: what survives projection out of the geometry.

With the whitened Jacobian J of everything already in the model, the prior rows below it, and an
orthonormal basis Q of both, a candidate has columns X (prior rows zero), and

.. math:: M = X^T X - (Q^T X)^T (Q^T X), \qquad b = X^T r,

are its information and score after projection, with r the whitened residual at the minimum. It is
judged by these two alone.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.diagnosis.effect import Moves
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.problem import whitened_blocks


@dataclass(frozen=True)
class Linearised:
    """Whitened residual and Jacobian, scalar by scalar.

    Parameters
    ----------
    W
        Derivative with respect to every geometric parameter.
    row
        Row of each scalar.
    free
        Parameters that are in the fit.
    prior_precision
        Of those.
    r
        Whitened residual.
    more
        Columns of effects already in the model, and their prior precision.
    """

    W: Float[Array, "parameter scalar"]
    row: Int[Array, "scalar"]
    free: Int[Array, "free"]
    prior_precision: Float[Array, "free"]
    r: Float[Array, "scalar"]
    more: Float[Array, "scalar extra"]
    more_precision: Float[Array, "extra"]

    @property
    def n_rows(self) -> int:
        """Number of rows."""
        return int(self.row.max()) + 1

    @cached_property
    def n_measured(self) -> int:
        """Number of measured scalars; what a row lacks stands there with weight zero."""
        return int((self.W != 0.0).any(axis=0).sum())

    @cached_property
    def first_scalar(self) -> Int[Array, "row"]:
        """Where each row begins."""
        return np.searchsorted(self.row, np.arange(self.n_rows))

    def row_sums(self, values: Float[Array, "scalar column"]) -> Float[Array, "row column"]:
        """Sums over the scalars of each row."""
        return np.asarray(np.add.reduceat(values, self.first_scalar, axis=0))

    @cached_property
    def known(self) -> Float[Array, "scalar column"]:
        """Columns of everything in the model."""
        return np.concatenate([self.W[self.free].T, self.more], axis=1)

    @cached_property
    def precision(self) -> Float[Array, "column"]:
        """Prior precision of these columns."""
        return np.concatenate([self.prior_precision, self.more_precision])

    @cached_property
    def _to_basis(self) -> Float[Array, "column direction"]:
        """What makes an orthonormal basis of columns with their prior rows."""
        length = np.sqrt((self.known**2).sum(axis=0) + self.precision)
        length[length == 0.0] = 1.0
        scaled = self.known / length
        gram = scaled.T @ scaled + np.diag(self.precision / length**2)
        values, vectors = np.linalg.eigh(gram)
        kept = values > 1e-12 * values[-1]
        return np.asarray(vectors[:, kept] / np.sqrt(values[kept]) / length[:, None])

    @cached_property
    def basis(self) -> Float[Array, "scalar direction"]:
        """The data part of that basis."""
        return np.asarray(self.known @ self._to_basis)

    def refitted(
        self, r: Float[Array, "scalar"], pull: Float[Array, "column"]
    ) -> Float[Array, "scalar"]:
        """A residual after the refit of everything in the model, to first order.

        Parameters
        ----------
        r
            Before.
        pull
            Of the priors, where the residual was taken: precision times distance from their means.
        """
        return np.asarray(r - self.basis @ (self.basis.T @ r - self._to_basis.T @ pull))

    def in_units_of(self, scale: float) -> "Linearised":
        """The same with the noise `scale` times the declared one."""
        if scale == 1.0:
            return self
        return Linearised(
            W=self.W / scale,
            row=self.row,
            free=self.free,
            prior_precision=self.prior_precision,
            r=self.r / scale,
            more=self.more / scale,
            more_precision=self.more_precision,
        )

    def some_rows(self, chosen: Bool[Array, "row"]) -> "Linearised":
        """The scalars of some rows, which need not be a minimum for them."""
        if chosen.all():
            return self
        scalars = chosen[self.row]
        return Linearised(
            W=self.W[:, scalars],
            row=(np.cumsum(chosen) - 1)[self.row[scalars]],
            free=self.free,
            prior_precision=self.prior_precision,
            r=self.r[scalars],
            more=self.more[scalars],
            more_precision=self.more_precision,
        )

    def columns(self, moves: Moves) -> Float[Array, "scalar coefficient"]:
        """Whitened effect of moves of the parameters."""
        first = next(iter(moves.values()))
        X = np.zeros((len(self.row), first.shape[1]))
        for parameter, values in moves.items():
            X += self.W[parameter][:, None] * values[self.row]
        return X

    def scored(
        self, X: Float[Array, "scalar coefficient"]
    ) -> tuple[Float[Array, "coefficient coefficient"], Float[Array, "coefficient"]]:
        """Information and score of candidate columns after projection."""
        inside = self.basis.T @ X
        return X.T @ X - inside.T @ inside, X.T @ self.r


def linearise(
    cell: CellModel,
    rows: Observations,
    free: Int[Array, "free"],
    prior_precision: Float[Array, "free"],
) -> Linearised:
    """Residual and Jacobian of the robot's parameters at a fitted cell, in row order."""
    everything = np.arange(len(cell.names))
    parts_W, parts_r, parts_row = [], [], []
    for block in whitened_blocks(cell, rows, everything):
        parts_W.append(block.J)
        parts_r.append(block.r)
        parts_row.append(np.tile(block.rows, block.components))
    row = np.concatenate(parts_row)
    order = np.argsort(row, kind="stable")
    return Linearised(
        W=np.concatenate(parts_W, axis=1)[:, order],
        row=row[order],
        free=free,
        prior_precision=prior_precision,
        r=np.concatenate(parts_r)[order],
        more=np.zeros((len(row), 0)),
        more_precision=np.zeros(0),
    )
