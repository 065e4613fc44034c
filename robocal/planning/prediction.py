r"""The tool's uncertainty that a set of poses promises over a workspace, and the set that is best.

With information M of the set, the covariance of the target's position at a test pose is
:math:`J_t M^{-1} J_t^T`; its mean trace over the test poses is :math:`\mathrm{tr}(W M^{-1})`
(I- or V-optimality). A pose that comes or goes changes it by

.. math:: \mp\,\mathrm{tr}\,(I \pm S_i)^{-1} T_i,\qquad S_i = J_i M^{-1} J_i^T,\quad
   T_i = J_i M^{-1} W M^{-1} J_i^T.

References
----------
.. [1] A. C. Atkinson, A. N. Donev, R. D. Tobias, *Optimum Experimental Designs, with SAS*, Oxford
   University Press, 2007, chapters 10 and 12.
"""

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.planning.chosen_set import Rows, information
from robocal.planning.products import times_columns

COVERAGE = 0.95
"""Probability that the target is within the stated radius"""


class PredictionSet:
    """A set of poses judged by the mean variance of the target over the test poses."""

    def __init__(self, J: Rows, test_rows: Float[Array, "test 3 parameter"]) -> None:
        self._J = J
        n_poses, n_rows, n_parameters = J.shape
        self._columns = np.ascontiguousarray(J.transpose(2, 1, 0)).reshape(n_parameters, -1)
        self._shape = (-1, n_rows, n_poses)
        self._eye = np.eye(n_rows)
        flat = test_rows.reshape(-1, n_parameters)
        # Any factor of W does; this one has as many rows as there are parameters.
        self._factor = np.linalg.qr(flat, mode="r") / np.sqrt(len(test_rows))
        self.restart(())

    @property
    def chosen(self) -> tuple[int, ...]:
        """Candidates in the set."""
        return tuple(self._chosen)

    def restart(self, chosen: tuple[int, ...]) -> None:
        """Replace the set."""
        self._chosen = list(chosen)
        self._inverse = np.linalg.inv(information(self._J, chosen))

    def change(self, leaving: tuple[int, ...], coming: tuple[int, ...]) -> None:
        """Take some candidates out and put others in."""
        kept = tuple(member for member in self._chosen if member not in leaving)
        self.restart((*kept, *coming))

    def best_addition(self) -> int:
        """The candidate outside that lowers the variance most."""
        return self._best_addition(self._inverse, self.chosen)

    def best_addition_without(self, old: int) -> int:
        """The candidate that lowers the variance most once `old` has gone; may be `old` itself."""
        kept = tuple(member for member in self._chosen if member != old)
        return self._best_addition(np.linalg.inv(information(self._J, kept)), kept)

    def _best_addition(
        self, inverse: Float[Array, "parameter parameter"], chosen: tuple[int, ...]
    ) -> int:
        solved = times_columns(inverse, self._columns)
        seen = times_columns(self._factor, solved).reshape(self._shape)
        S = np.einsum(
            "lan,lbn->nab", self._columns.reshape(self._shape), solved.reshape(self._shape)
        )
        T = np.einsum("lan,lbn->nab", seen, seen)
        gain = np.einsum("nii->n", np.linalg.solve(self._eye + S, T))
        gain[list(chosen)] = -np.inf
        return int(np.argmax(gain))

    def best_removal_after(self, added: int) -> int:
        """The candidate inside whose loss raises it least, once `added` is in."""
        members = np.array(sorted((*self._chosen, added)))
        inverse = np.linalg.inv(information(self._J, (*self._chosen, added)))
        J = self._J[members]
        solved = J @ inverse
        seen = solved @ self._factor.T
        S = solved @ np.swapaxes(J, 1, 2)
        loss = np.linalg.solve(self._eye - S, seen @ np.swapaxes(seen, 1, 2))
        return int(members[np.argmin(np.einsum("nii->n", loss))])

    def value(self) -> float:
        """The mean variance, negative so that larger is better [m2]."""
        return -float(((self._factor @ self._inverse) * self._factor).sum())


def predicted_radius(
    J: Rows, chosen: Int[Array, "chosen"], test_rows: Float[Array, "test 3 parameter"]
) -> Float[Array, "test"]:
    """Distance from the estimate within which the target is with probability `COVERAGE` [m].

    Speaks of the declared instrument noise alone, carried through the parameters.

    Parameters
    ----------
    J
        Whitened, scaled rows of the candidates.
    chosen
        The set.
    test_rows
        Position rows at the test poses, in the same scaled parameters [m].
    """
    rows = J[chosen].reshape(-1, J.shape[2])
    inverse = np.linalg.inv(rows.T @ rows)
    return coverage_radius(test_rows @ inverse @ np.swapaxes(test_rows, 1, 2))


def coverage_radius(covariance: Float[Array, "pose 3 3"]) -> Float[Array, "pose"]:
    r"""Radius that holds `COVERAGE` of a normal distribution about its mean [m].

    The squared distance is taken as :math:`g \chi^2_h` with the same mean and variance, which for
    three coordinates is within 2 % of the exact radius.

    References
    ----------
    .. [1] F. E. Satterthwaite, Biometrics Bulletin 2(6), 1946.
    """
    from scipy.special import gammaincinv

    trace = np.einsum("nii->n", covariance)
    squared = np.einsum("nij,nij->n", covariance, covariance)
    h = trace**2 / squared
    return np.asarray(np.sqrt(squared / trace * 2.0 * gammaincinv(h / 2.0, COVERAGE)))
