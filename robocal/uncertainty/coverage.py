"""Coverage intervals and numerical tolerance of a sample of the output quantity.

References
----------
.. [1] JCGM 101:2008, 5.3.4, 7.7, 7.9.2.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


@dataclass(frozen=True)
class Interval:
    """Coverage interval of each output, in the unit of the output."""

    low: Float[Array, "output"]
    high: Float[Array, "output"]


def symmetric_interval(draws: Float[Array, "output draw"], coverage: float) -> Interval:
    """Probabilistically symmetric: as much probability below as above (JCGM 101, 7.7.2)."""
    ordered = np.sort(draws, axis=1)
    inside = _whole_count(ordered.shape[1], coverage)
    first = (ordered.shape[1] - inside) // 2
    return Interval(ordered[:, first], ordered[:, first + inside])


def shortest_interval(draws: Float[Array, "output draw"], coverage: float) -> Interval:
    """The shortest one that holds the probability (JCGM 101, 7.7.4); for skew distributions."""
    ordered = np.sort(draws, axis=1)
    inside = _whole_count(ordered.shape[1], coverage)
    lengths = ordered[:, inside:] - ordered[:, : ordered.shape[1] - inside]
    first = np.argmin(lengths, axis=1)
    output = np.arange(len(ordered))
    return Interval(ordered[output, first], ordered[output, first + inside])


def _whole_count(n_draws: int, coverage: float) -> int:
    """JCGM 101, 7.7.1: p M, to the nearest whole; one less than all draws at most."""
    return min(round(coverage * n_draws), n_draws - 1)


def numerical_tolerance(std: Float[Array, "output"], digits: int) -> Float[Array, "output"]:
    r"""Half a unit in the last of so many significant digits of the standard uncertainty.

    With :math:`u = c \\cdot 10^\\ell`, c a whole number of `digits` digits, it is
    :math:`\\tfrac12 10^\\ell`.

    References
    ----------
    .. [1] JCGM 101:2008, 7.9.2.

    Examples
    --------
    >>> numerical_tolerance(np.array([0.00035, 2.0]), 2)
    array([5.e-06, 5.e-02])
    """
    known = std > 0
    size = np.floor(np.log10(np.where(known, std, 1.0)))
    # 9.96 with two digits rounds to 10, which is one decade up.
    rounded = np.round(std / 10.0 ** (size - digits + 1)) * 10.0 ** (size - digits + 1)
    size = np.where(rounded >= 10.0 ** (size + 1), size + 1, size)
    return np.asarray(np.where(known, 0.5 * 10.0 ** (size - digits + 1), 0.0))
