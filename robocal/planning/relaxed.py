r"""The relaxed D-optimal problem: weights in place of yes and no, and its largest weights.

The multiplicative algorithm :math:`w_i \leftarrow w_i\,\mathrm{tr}(J_i M_w^{-1} J_i^T) / L` climbs
to the weights with the largest determinant. By the equivalence theorem, the largest of those traces
tells how far any set can still be from the optimum: a certificate for every selector.

References
----------
.. [1] S. D. Silvey, D. M. Titterington, B. Torsney, Communications in Statistics A 7(14), 1978.
.. [2] J. Kiefer, J. Wolfowitz, Canadian Journal of Mathematics 12, 1960.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.planning.chosen_set import Rows, Selection

_MAX_ITERATIONS = 400
_GAP = 1e-3
"""Stop when no set can beat the weights by more than this in log det / L; [1]"""


@dataclass(frozen=True)
class RelaxedDesign:
    """Weights of the candidates, and the bound that follows."""

    weights: Float[Array, "pose"]
    """Sum to one; [1]"""
    largest_index_1: float
    """O1 that no set of any size exceeds; [1]"""


def relaxed_design(J: Rows) -> RelaxedDesign:
    """Weights whose information has nearly the largest determinant."""
    n_poses, _, n_parameters = J.shape
    weights = np.full(n_poses, 1.0 / n_poses)
    for _ in range(_MAX_ITERATIONS):
        M = _weighted(J, weights)
        traces = np.einsum("nrl,nrl->n", J @ np.linalg.inv(M), J)
        gap = np.log(traces.max() / n_parameters)
        if gap < _GAP:
            break
        weights = weights * traces / n_parameters
    # log det is concave: no design exceeds this one by more than L log(max trace / L).
    logdet = float(np.linalg.slogdet(M)[1])
    return RelaxedDesign(weights, float(np.exp((logdet / n_parameters + gap) / 2.0)))


def select(selection: Selection) -> Int[Array, "chosen"]:
    """The candidates of largest weight, in rising order."""
    weights = relaxed_design(selection.J).weights
    order = np.argsort(-weights, kind="stable")
    return np.sort(order[: selection.count])


def _weighted(J: Rows, weights: Float[Array, "pose"]) -> Float[Array, "parameter parameter"]:
    rows = (J * np.sqrt(weights)[:, None, None]).reshape(-1, J.shape[2])
    return np.asarray(rows.T @ rows)
