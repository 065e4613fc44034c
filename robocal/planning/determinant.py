r"""O1 by updates: the determinant of the information matrix when one pose comes or goes.

With rows :math:`J_i` (r by L) and information :math:`M`, by the matrix determinant lemma

.. math:: \det(M \pm J_i^T J_i) = \det M\,\det(I \pm S_i),\qquad S_i = J_i M^{-1} J_i^T,

and Woodbury's formula turns every :math:`S_i` into its next value by products of r columns, so
no factorisation of M is needed while poses are exchanged.

References
----------
.. [1] V. V. Fedorov, *Theory of Optimal Experiments*, Academic Press, 1972.
"""

import math

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
_WEAK = 1e5
"""Trace of the inverse information above which a set with rows enough is nearly singular all the
same, as where rows depend on each other; [1]"""
_SINGULAR = 1e-6
"""Ratio of determinants below which a change is computed anew; also the least pivot; [1]"""


class DeterminantSet:
    """A set of poses judged by O1 (its logarithm, up to a constant of the set's size)."""

    def __init__(self, J: Rows) -> None:
        self._J = J
        n_poses, n_rows, n_parameters = J.shape
        self._columns = np.ascontiguousarray(J.transpose(2, 1, 0)).reshape(n_parameters, -1)
        self._shape = (-1, n_rows, n_poses)
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
        self._grown = self._grown_by(self._inverse)

    def change(self, leaving: tuple[int, ...], coming: tuple[int, ...]) -> None:
        """Take some candidates out and put others in, by one update of their joint rank."""
        kept = [member for member in self._chosen if member not in leaving]
        kept.extend(coming)
        if self._changes > _REFRESH or self._is_weak(len(kept)):
            self.restart(tuple(kept))
            return
        rows = self._J[[*leaving, *coming]].reshape(-1, self._J.shape[2])
        sign = np.ones(len(rows))
        sign[: len(leaving) * self._eye.shape[0]] = -1.0
        seen = rows @ self._inverse
        grown = sign[:, None] * (seen @ rows.T)
        grown.ravel()[:: len(rows) + 1] += 1.0
        ratio = abs(float(np.linalg.det(grown)))
        if ratio < _SINGULAR:
            self.restart(tuple(kept))
            return
        self._chosen = kept
        self._changes += 1
        self._logdet += math.log(ratio)
        solved = np.linalg.inv(grown) * sign
        self._inverse -= seen.T @ (solved @ seen)
        across = times_columns(seen, self._columns)
        self._grown -= _squared(across.reshape(self._shape), (solved @ across).reshape(self._shape))

    def best_addition(self) -> int:
        """The candidate outside that multiplies the determinant most."""
        growth = _determinants(self._grown)
        growth[self._chosen] = -np.inf
        return int(np.argmax(growth))

    def best_removal_after(self, added: int) -> int:
        """The candidate inside that divides the determinant least, once `added` is in."""
        members = np.array(sorted((*self._chosen, added)))
        J = self._J[members]
        if self._is_weak(len(self._chosen)):
            without = information(self._J, (*self._chosen, added)) - np.swapaxes(J, 1, 2) @ J
            return int(members[np.argmax(np.linalg.slogdet(without)[1])])
        seen = self._J[added] @ self._inverse
        across = seen @ J.transpose(2, 1, 0).reshape(len(seen.T), -1)
        turned = np.linalg.inv(self._grown[:, :, added]) @ across
        shape = (-1, len(seen), len(members))
        left = _squared(across.reshape(shape), turned.reshape(shape))
        left -= self._grown[:, :, members]
        left += 2.0 * self._eye[:, :, None]
        return int(members[np.argmax(_determinants(left))])

    def best_addition_without(self, old: int) -> int:
        """The candidate that multiplies the determinant most once `old` has gone; may be `old`."""
        kept = tuple(member for member in self._chosen if member != old)
        growth = _determinants(self._grown_without(old, kept))
        growth[list(kept)] = -np.inf
        return int(np.argmax(growth))

    def value(self) -> float:
        """Logarithm of the determinant."""
        return self._logdet

    def _grown_without(self, old: int, kept: tuple[int, ...]) -> Float[Array, "row row pose"]:
        left = 2.0 * self._eye - self._grown[:, :, old]
        if self._is_weak(len(kept)) or np.linalg.det(left) < _SINGULAR:
            return self._grown_by(np.linalg.inv(information(self._J, kept)))
        across = times_columns(self._J[old] @ self._inverse, self._columns)
        turned = np.linalg.inv(left) @ across
        lost = _squared(across.reshape(self._shape), turned.reshape(self._shape))
        return np.asarray(self._grown + lost)

    def _grown_by(
        self, inverse: Float[Array, "parameter parameter"]
    ) -> Float[Array, "row row pose"]:
        """I + S of every pose."""
        solved = times_columns(inverse, self._columns)
        S = _squared(self._columns.reshape(self._shape), solved.reshape(self._shape))
        return np.asarray(S + self._eye[:, :, None])

    def _is_weak(self, count: int) -> bool:
        few = count * len(self._eye) < _UPDATED * len(self._inverse)
        return bool(few or self._inverse.trace() > _WEAK)


def _squared(
    one: Float[Array, "inner row pose"], other: Float[Array, "inner row pose"]
) -> Float[Array, "row row pose"]:
    """For every pose the product of one, transposed, and the other."""
    return np.asarray(np.einsum("can,cbn->abn", one, other))


def _determinants(grown: Float[Array, "row row pose"]) -> Float[Array, "pose"]:
    """Determinants of positive semidefinite matrices, one a pose, by elimination."""
    left = grown
    product = np.maximum(left[0, 0], _SINGULAR)
    for _ in range(1, len(grown)):
        pivot = np.maximum(left[0, 0], _SINGULAR)
        left = left[1:, 1:] - left[1:, :1] * (left[:1, 1:] / pivot)
        product *= np.maximum(left[0, 0], _SINGULAR)
    return np.asarray(product)
