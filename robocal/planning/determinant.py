r"""O1 by updates: the determinant of the information matrix when one pose comes or goes.

With rows :math:`J_i` (r by L) and information :math:`M`, by the matrix determinant lemma

.. math:: \det(M \pm J_i^T J_i) = \det M\,\det(I \pm S_i),\qquad S_i = J_i M^{-1} J_i^T,

and Woodbury's formula turns every :math:`S_i` into its next value by products of r columns, so
no factorisation of M is needed while poses are exchanged.

References
----------
.. [1] V. V. Fedorov, *Theory of Optimal Experiments*, Academic Press, 1972.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.planning.chosen_set import Rows, information
from robocal.planning.products import times_columns

_REFRESH = 200
"""Changes after which S is computed anew, against the growth of rounding errors"""

_UPDATED = 1.5
"""Rows per parameter below which a set may be nearly singular and is computed anew at each change,
because updates would lose its digits; [1]"""


class DeterminantSet:
    """A set of poses judged by O1 (its logarithm, up to a constant of the set's size)."""

    def __init__(self, J: Rows) -> None:
        self._J = J
        n_poses, n_rows, n_parameters = J.shape
        self._columns = np.ascontiguousarray(J.transpose(2, 1, 0)).reshape(n_parameters, -1)
        self._shape = (n_rows, n_poses)
        self._eye = np.eye(n_rows)
        self.restart(())

    @property
    def chosen(self) -> tuple[int, ...]:
        """Candidates in the set."""
        return tuple(self._chosen)

    def restart(self, chosen: tuple[int, ...]) -> None:
        """Replace the set."""
        self._chosen = list(chosen)
        M = information(self._J, chosen)
        self._logdet = float(np.linalg.slogdet(M)[1])
        self._inverse = np.linalg.inv(M)
        self._changes = 0
        solved = times_columns(self._inverse, self._columns)
        shape = (-1, *self._shape)
        self._S = np.einsum("lan,lbn->abn", self._columns.reshape(shape), solved.reshape(shape))

    def change(self, leaving: tuple[int, ...], coming: tuple[int, ...]) -> None:
        """Take some candidates out and put others in, by one update of their joint rank."""
        self._chosen = [member for member in self._chosen if member not in leaving]
        self._chosen.extend(coming)
        self._changes += 1
        if self._changes > _REFRESH or self._is_small():
            self.restart(self.chosen)
            return
        rows = self._J[[*leaving, *coming]].reshape(-1, self._J.shape[2])
        sign = np.ones(len(rows))
        sign[: len(leaving) * self._shape[0]] = -1.0
        seen = rows @ self._inverse
        grown = sign[:, None] * (seen @ rows.T)
        grown.ravel()[:: len(rows) + 1] += 1.0
        self._logdet += float(np.linalg.slogdet(grown)[1])
        solved = np.linalg.inv(grown) * sign
        self._inverse -= seen.T @ (solved @ seen)
        across = times_columns(seen, self._columns)
        turned = (solved @ across).reshape(-1, *self._shape)
        self._S -= np.einsum("can,cbn->abn", across.reshape(-1, *self._shape), turned)

    def best_addition(self) -> int:
        """The candidate outside that multiplies the determinant most."""
        growth = _determinants(self._S)
        growth[self._chosen] = -np.inf
        return int(np.argmax(growth))

    def best_removal_after(self, added: int) -> int:
        """The candidate inside that divides the determinant least, once `added` is in."""
        members = np.array(sorted((*self._chosen, added)))
        if self._is_small():
            J = self._J[members]
            without = information(self._J, (*self._chosen, added)) - np.swapaxes(J, 1, 2) @ J
            return int(members[np.argmax(np.linalg.slogdet(without)[1])])
        seen = self._J[added] @ self._inverse
        shape = (-1, self._shape[0], len(members))
        across = seen @ self._columns.reshape(-1, *self._shape)[:, :, members].reshape(
            len(seen.T), -1
        )
        turned = np.linalg.inv(self._eye + self._S[:, :, added]) @ across
        S = np.einsum("can,cbn->abn", across.reshape(shape), turned.reshape(shape))
        S -= self._S[:, :, members]
        return int(members[np.argmax(_determinants(S))])

    def value(self) -> float:
        """Logarithm of the determinant."""
        return self._logdet

    def _is_small(self) -> bool:
        return bool(len(self._chosen) * self._shape[0] < _UPDATED * len(self._inverse))


def _determinants(S: Float[Array, "row row pose"]) -> Float[Array, "pose"]:
    """Determinants of I + S for every pose, by elimination (I + S is positive definite)."""
    A = S.copy()
    n_rows = len(A)
    for k in range(n_rows):
        A[k, k] += 1.0
    product = A[0, 0].copy()
    for k in range(1, n_rows):
        A[k:, k:] -= A[k:, k - 1, None] * (A[k - 1, k:] / A[k - 1, k - 1])
        product *= A[k, k]
    return np.asarray(product)
