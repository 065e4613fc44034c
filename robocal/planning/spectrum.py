r"""Any index of the singular values: exact choice, with bounds that spare most factorisations.

In the eigenvectors of the present information matrix, M = diag(d). Adding (or taking) a pose gives
:math:`A = diag(d) \pm U^T U`. Keeping of A only its diagonal, or a block on some eigenvectors and
the diagonal of the rest (a pinching), leaves a spectrum that A's own majorises [1]_. All five
indices can only grow by that, so they bound A's index from above, and a candidate whose bound is
below an exact value already found need not be factorised. The choice is the same as without bounds.

References
----------
.. [1] R. Bhatia, *Matrix Analysis*, Springer, 1997, II.5 and II.42 (pinching, majorisation).
"""

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.planning.chosen_set import Rows, information, outside
from robocal.planning.observability import INDICES

_BLOCK = 6
"""Eigenvectors of the smallest eigenvalues that the second bound keeps together"""
_CHUNK = 12
"""Candidates that are factorised at a time"""


class SpectrumSet:
    """A set of poses judged by one of the observability indices."""

    def __init__(self, J: Rows, index: str) -> None:
        self._J = J
        self._index = INDICES[index]
        self.restart(())

    @property
    def chosen(self) -> tuple[int, ...]:
        """Candidates in the set."""
        return tuple(self._chosen)

    def restart(self, chosen: tuple[int, ...]) -> None:
        """Replace the set."""
        self._chosen = list(chosen)
        self._M = information(self._J, chosen)

    def change(self, leaving: tuple[int, ...], coming: tuple[int, ...]) -> None:
        """Take some candidates out and put others in."""
        kept = tuple(member for member in self._chosen if member not in leaving)
        self.restart((*kept, *coming))

    def best_addition(self) -> int:
        """The candidate outside that makes the index largest."""
        return self._best(self._M, outside(len(self._J), self.chosen), 1.0)

    def best_removal_after(self, added: int) -> int:
        """The candidate inside without which the index is largest, once `added` is in."""
        M = self._M + self._J[added].T @ self._J[added]
        return self._best(M, np.array(sorted((*self._chosen, added))), -1.0)

    def best_addition_without(self, old: int) -> int:
        """The candidate that makes the index largest once `old` has gone; may be `old` itself."""
        kept = tuple(member for member in self._chosen if member != old)
        return self._best(information(self._J, kept), outside(len(self._J), kept), 1.0)

    def value(self) -> float:
        """The index."""
        return float(self._judge(np.linalg.eigvalsh(self._M)))

    def _judge(self, eigenvalues: Float[Array, "*stack sigma"]) -> Float[Array, "*stack"]:
        return self._index(np.sqrt(np.maximum(eigenvalues, 0.0)), max(len(self._chosen), 1))

    def _best(
        self,
        M: Float[Array, "parameter parameter"],
        candidates: Int[Array, "candidate"],
        sign: float,
    ) -> int:
        from scipy.linalg import eigh

        # numpy's eigh divides the work among threads at this size, at twenty times the cost.
        d, V = eigh(M, driver="ev", check_finite=False)
        U = self._J[candidates] @ V
        diagonal = d + sign * np.einsum("crl,crl->cl", U, U)
        bound = self._judge(diagonal)
        order = np.argsort(-bound, kind="stable")
        first = order[:_CHUNK]
        best, floor = self._exact_best(d, U, sign, first)
        rest = order[_CHUNK:]
        rest = rest[bound[rest] >= floor]
        if len(rest) > _CHUNK:
            finer = self._judge(_pinched(d, U[rest], diagonal[rest], sign))
            closer = np.argsort(-finer, kind="stable")
            rest, bound = rest[closer], finer[closer]
        else:
            bound = bound[rest]
        for start in range(0, len(rest), _CHUNK):
            if bound[start] < floor:
                break
            chunk, value = self._exact_best(d, U, sign, rest[start : start + _CHUNK])
            if value > floor or (value == floor and chunk < best):
                best, floor = chunk, value
        return int(candidates[best])

    def _exact_best(
        self,
        d: Float[Array, "sigma"],
        U: Float[Array, "candidate row sigma"],
        sign: float,
        some: Int[Array, "some"],
    ) -> tuple[int, float]:
        A = sign * (np.swapaxes(U[some], 1, 2) @ U[some])
        A[:, np.arange(len(d)), np.arange(len(d))] += d
        value = self._judge(np.linalg.eigvalsh(A))
        largest = int(np.argmax(value))
        return int(some[largest]), float(value[largest])


def _pinched(
    d: Float[Array, "sigma"],
    U: Float[Array, "candidate row sigma"],
    diagonal: Float[Array, "candidate sigma"],
    sign: float,
) -> Float[Array, "candidate sigma"]:
    """Spectrum of the block on the first eigenvectors, and the diagonal of the rest."""
    low = U[:, :, :_BLOCK]
    block = sign * (np.swapaxes(low, 1, 2) @ low)
    kept = np.arange(low.shape[2])
    block[:, kept, kept] += d[kept]
    return np.concatenate([np.linalg.eigvalsh(block), diagonal[:, len(kept) :]], axis=1)
