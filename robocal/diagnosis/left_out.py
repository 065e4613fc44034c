"""Residuals predicted without their own fold, with all effects and with one of them taken out.

First order: the products of every fold are kept, so that a model with an effect less costs one
small solution a fold and two passes over the rows.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.diagnosis.linearised import Linearised


@dataclass(frozen=True)
class _Fold:
    """The scalars of one fold."""

    scalars: Bool[Array, "scalar"]
    A: Float[Array, "inside column"]
    gram: Float[Array, "column column"]


class LeftOut:
    """The folds of a fit at its minimum.

    Parameters
    ----------
    fit
        With the effects among its known columns.
    fold_of_row
        Number of the fold of every row.
    """

    def __init__(self, fit: Linearised, fold_of_row: Int[Array, "row"]) -> None:
        self._fit = fit
        self._folds = []
        fold = fold_of_row[fit.row]
        for number in np.unique(fold_of_row):
            inside = fold == number
            A = fit.known[inside]
            self._folds.append(_Fold(inside, A, A.T @ A))
        self._gram = sum((fold.gram for fold in self._folds), np.diag(fit.precision))

    def sizes(self) -> Float[Array, "row"]:
        """Length of each row's whitened residual, predicted without its fold."""
        kept: Bool[Array, "column"] = np.ones(len(self._gram), dtype=bool)
        # At the minimum the whole score is the prior's; without the fold its own part is missing.
        return self._sizes(kept, self._fit.r)

    def without(
        self, kept: Bool[Array, "column"], values: Float[Array, "dropped"]
    ) -> tuple[Float[Array, "row"], float]:
        """The same of the model refitted without some columns.

        Parameters
        ----------
        kept
            Columns that stay.
        values
            Coefficients of the others at the minimum.

        Returns
        -------
        sizes
            As of `sizes`.
        chi_square
            Of the refitted model on all rows.
        """
        pulled = self._gram[np.ix_(kept, ~kept)] @ values
        step = _solve(self._gram[np.ix_(kept, kept)], pulled)
        change = np.zeros(len(kept))
        change[kept], change[~kept] = -step, values
        r = self._fit.r + self._fit.known @ change
        return self._sizes(kept, r), float(r @ r)

    def _sizes(self, kept: Bool[Array, "column"], r: Float[Array, "scalar"]) -> Float[Array, "row"]:
        out = np.empty(len(r))
        every = np.ix_(kept, kept)
        gram = self._gram[every]
        for fold in self._folds:
            own = r[fold.scalars]
            pull = np.where(kept, fold.A.T @ own, 0.0)
            step = np.zeros(len(kept))
            step[kept] = _solve(gram - fold.gram[every], pull[kept])
            out[fold.scalars] = own + fold.A @ step
        return np.asarray(np.sqrt(self._fit.row_sums((out * out)[:, None])[:, 0]))


def _solve(hessian: Float[Array, "n n"], pull: Float[Array, "n"]) -> Float[Array, "n"]:
    """Through its scaled form: unknowns are in m, rad and whatever effects come in."""
    scale = 1.0 / np.sqrt(np.diag(hessian) + 1e-300)
    return np.asarray(np.linalg.solve(hessian * np.outer(scale, scale), pull * scale) * scale)
