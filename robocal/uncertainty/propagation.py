r"""The law of propagation of uncertainty for any measurement function of a few inputs.

.. math::
   u_c^2(y) = \sum_{ij} c_i c_j u(x_i, x_j), \qquad
   \nu_{eff} = u_c^4 \Big/ \sum_i \frac{(c_i u_i)^4}{\nu_i}

Sensitivities :math:`c_i` are central differences over a tenth of the standard uncertainty, which is
exact for the squares and products of most budgets. The second order adds
:math:`\sum_{ij} (\tfrac12 f_{ij}^2 + f_i f_{ijj}) u_i^2 u_j^2` for independent inputs.

References
----------
.. [1] JCGM 100:2008 (GUM), 5.1.2 with its note, 5.2.2, G.4.1.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.uncertainty.distributions import Distribution

Function = Callable[[Float[Array, "input draw"]], Float[Array, "draw"]]
COVERAGE = 0.95
"""Probability of coverage intervals unless another is asked for; [1]"""
_STEP = 0.1
"""Steps of the differences, in standard uncertainties; [1]"""
_TRUNCATE = 1e-9
"""Keeps whole degrees of freedom whole against rounding before GUM G.4.2 cuts them off; [1]"""


@dataclass(frozen=True)
class Propagated:
    """Result of the law of propagation, in the unit of the output."""

    estimate: float
    std: float
    """Combined standard uncertainty."""
    nu: float
    """Effective degrees of freedom."""
    contributions: Float[Array, "input"]
    """`c_i u_i` of each input, signed."""

    def expanded(self, coverage: float = COVERAGE) -> float:
        """U = k u, with k of Student's t for the effective degrees of freedom, cut to a whole."""
        return coverage_factor(self.nu, coverage) * self.std


def propagate(
    function: Function,
    inputs: Sequence[Distribution],
    correlation: Float[Array, "input input"] | None = None,
) -> Propagated:
    """First-order propagation.

    Parameters
    ----------
    function
        Measurement function; takes one column a set of inputs.
    inputs
        Input quantities.
    correlation
        Of the inputs; independent if None. Effective degrees of freedom are those of independent
        inputs, as the GUM gives no other.
    """
    x, u = _estimates(inputs)
    f = _differences(function, x, u)
    contributions = f.first
    r = np.eye(len(x)) if correlation is None else correlation
    variance = max(float(contributions @ r @ contributions), 0.0)
    nu = effective_nu(contributions**2, np.array([quantity.nu for quantity in inputs]))
    return Propagated(f.centre, float(np.sqrt(variance)), nu, contributions)


def propagate_second_order(function: Function, inputs: Sequence[Distribution]) -> Propagated:
    """Propagation with the second-order terms of the GUM, for independent inputs.

    The estimate stays the function of the estimates, as in JCGM 101, 9.3.2.6.
    """
    x, u = _estimates(inputs)
    f = _differences(function, x, u)
    more = 0.5 * f.second**2 + f.first[:, None] * f.third
    variance = max(float((f.first**2).sum() + more.sum()), 0.0)
    nu = effective_nu(f.first**2, np.array([quantity.nu for quantity in inputs]))
    return Propagated(f.centre, float(np.sqrt(variance)), nu, f.first)


def effective_nu(variances: Float[Array, "source"], nu: Float[Array, "source"]) -> float:
    """Effective degrees of freedom of a sum of independent variances (Welch-Satterthwaite)."""
    certain = float(np.sum(variances**2 / nu))
    total = float(np.sum(variances))
    return total**2 / certain if certain > 0.0 else float("inf")


def coverage_factor(nu: float, coverage: float = COVERAGE) -> float:
    """Two-sided factor k: Student's t of the degrees of freedom cut to a whole (GUM, G.4.1)."""
    from scipy.special import ndtri, stdtrit

    if np.isinf(nu):
        return float(ndtri(0.5 + 0.5 * coverage))
    return float(stdtrit(np.floor(nu + _TRUNCATE), 0.5 + 0.5 * coverage))


@dataclass(frozen=True)
class _Differences:
    """Value and derivatives times standard uncertainties: they carry `u` already."""

    centre: float
    first: Float[Array, "input"]
    second: Float[Array, "input input"]
    third: Float[Array, "input input"]
    """Derivative once by the row's input and twice by the column's."""


def _estimates(
    inputs: Sequence[Distribution],
) -> tuple[Float[Array, "input"], Float[Array, "input"]]:
    x = np.array([quantity.estimate for quantity in inputs])
    return x, np.array([quantity.std for quantity in inputs])


def _differences(
    function: Function, x: Float[Array, "input"], u: Float[Array, "input"]
) -> _Differences:
    steps = np.diag(_STEP * u)
    n = len(x)

    def at(*moves: Float[Array, "input"]) -> float:
        return float(function((x + sum(moves))[:, None])[0])

    centre = at(np.zeros(n))
    plus = np.array([at(step) for step in steps])
    minus = np.array([at(-step) for step in steps])
    second, third = np.zeros((n, n)), np.zeros((n, n))
    for i, a in enumerate(steps):
        for j, b in enumerate(steps):
            pp, pm, mp, mm = at(a, b), at(a, -b), at(-a, b), at(-a, -b)
            second[i, j] = 0.25 * (pp - pm - mp + mm)
            # d/di of the second difference in j; for i = j the same over steps of two.
            third[i, j] = 0.5 * ((pp + pm - 2 * plus[i]) - (mp + mm - 2 * minus[i]))
            if i == j:
                second[i, i] = plus[i] - 2 * centre + minus[i]
                third[i, i] = 0.5 * (pp - 2 * plus[i] + 2 * minus[i] - mm)
    first = 0.5 * (plus - minus)
    return _Differences(centre, first / _STEP, second / _STEP**2, third / _STEP**3)
