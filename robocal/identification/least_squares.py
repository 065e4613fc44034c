r"""Levenberg-Marquardt on normal equations, with Gaussian priors.

Minimises :math:`\tfrac12 \lVert r(x) \rVert^2 + \tfrac12 \sum_k w_k (x_k - m_k)^2` where `w` is the
prior precision. The damping follows Nielsen's rule; columns are scaled by the Hessian's diagonal
(Marquardt), so that metres and radians need no common unit.

References
----------
.. [1] K. Madsen, H. B. Nielsen, O. Tingleff, *Methods for Non-Linear Least Squares Problems*,
   2nd ed., DTU, 2004, algorithm 3.16.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.identification.problem import NormalEquations

MAX_ITERATIONS = 200
_COST_TOLERANCE = 1e-12
"""Stop when a step promises less than this share of the cost, some ten times its rounding; [1]"""
_FIRST_DAMPING = 1e-5
"""Share of the Hessian's diagonal: starts are good, so that the first steps are nearly full; [1]"""


@dataclass(frozen=True)
class Prior:
    """Gaussian prior of each free parameter; precision zero where nothing is known."""

    mean: Float[Array, "free"]
    precision: Float[Array, "free"]


@dataclass(frozen=True)
class Minimum:
    """Where the iteration ended."""

    x: Float[Array, "free"]
    equations: NormalEquations
    """At `x`, without the prior."""
    hessian: Float[Array, "free free"]
    """With the prior."""
    cost: float
    """With the prior."""
    iterations: int
    converged: bool


def levenberg_marquardt(
    linearise: Callable[[Float[Array, "free"]], NormalEquations],
    start: Float[Array, "free"],
    prior: Prior,
    max_iterations: int = MAX_ITERATIONS,
) -> Minimum:
    """The minimum reached from `start`.

    Parameters
    ----------
    linearise
        Cost, gradient and Gauss-Newton Hessian of the data part at a point.
    start
        Starting point.
    prior
        Added to all three.
    max_iterations
        Evaluations of `linearise` at most.
    """
    x = start
    data = linearise(x)
    cost, gradient, hessian = _with_prior(data, prior, x)
    damping, growth = _FIRST_DAMPING, 2.0
    for iteration in range(1, max_iterations + 1):
        scale = np.sqrt(hessian.diagonal())
        scale[scale == 0.0] = 1.0
        damped = hessian / (scale[:, None] * scale)
        damped.flat[:: len(x) + 1] += damping
        step = -np.linalg.solve(damped, gradient / scale) / scale
        promised = -(gradient @ step + 0.5 * step @ hessian @ step)
        if promised <= _COST_TOLERANCE * max(cost, 1.0):
            return Minimum(x, data, hessian, cost, iteration, converged=True)
        trial = linearise(x + step)
        trial_cost, trial_gradient, trial_hessian = _with_prior(trial, prior, x + step)
        gain = (cost - trial_cost) / promised
        if gain > 0.0:
            x, data = x + step, trial
            cost, gradient, hessian = trial_cost, trial_gradient, trial_hessian
            damping *= max(1.0 / 3.0, 1.0 - (2.0 * gain - 1.0) ** 3)
            damping = max(damping * 0.1, 1e-12) if gain > 0.9 else damping
            growth = 2.0
        else:
            damping *= growth
            growth *= 2.0
            if damping > 1e12:
                return Minimum(x, data, hessian, cost, iteration, converged=True)
    return Minimum(x, data, hessian, cost, max_iterations, converged=False)


def _with_prior(
    data: NormalEquations, prior: Prior, x: Float[Array, "free"]
) -> tuple[float, Float[Array, "free"], Float[Array, "free free"]]:
    away = x - prior.mean
    cost = data.cost + 0.5 * float(prior.precision @ (away * away))
    hessian = data.hessian.copy()
    hessian.flat[:: len(x) + 1] += prior.precision
    return cost, data.gradient + prior.precision * away, hessian
