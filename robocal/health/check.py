"""A health check: is the released model still right, and if not, what moved.

Chi-square of all residuals against noise and the model's predicted uncertainty says whether. Which
alternative explains it is weighed by marginal likelihood: each movement's numbers are integrated
out over a normal prior whose width is averaged from a tenth to ten times the usual size, so that
a movement with more numbers is not preferred for fitting more noise.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.special import chdtrc, chdtri, logsumexp

from robocal.health.movements import Movement, derivatives, moved, movements
from robocal.health.residual import Residual

FALSE_ALARM = 0.001
"""Share of checks of a healthy robot that alarm; [1]"""
_WIDTHS = np.array([0.1, 0.3, 1.0, 3.0, 10.0])
_STEPS = 6
LIKELY = 0.05
"""Probability from which an alternative cannot be set aside; [1]"""
_ALIKE = 0.01
"""Share of a movement that another one leaves unexplained, below which no pose tells them apart"""


@dataclass(frozen=True)
class Alternative:
    """One movement fitted to the residuals."""

    movement: Movement
    numbers: Float[Array, "number"]
    """[m, rad, 1]"""
    std: Float[Array, "number"]
    probability: float
    p_value: float
    """Of what it leaves: small where it does not explain everything."""


@dataclass(frozen=True)
class HealthCheck:
    """What a health check showed.

    Parameters
    ----------
    chi_square, nu, p_value, limit
        Statistic, degrees of freedom, its probability for a healthy robot, and the alarm limit.
    z
        The statistic as a standard normal one, for the trend.
    position_rms
        Of the residuals [m].
    alternatives
        The most probable first; empty without an alarm.
    """

    chi_square: float
    nu: int
    p_value: float
    limit: float
    z: float
    position_rms: float
    alternatives: tuple[Alternative, ...]

    @property
    def alarm(self) -> bool:
        """Whether something has moved."""
        return self.chi_square > self.limit

    @property
    def explained(self) -> bool:
        """Whether the most probable movement explains what was seen."""
        return bool(self.alternatives) and self.alternatives[0].p_value > FALSE_ALARM

    @property
    def undecided(self) -> tuple[Alternative, ...]:
        """Alternatives that cannot be set aside."""
        return tuple(found for found in self.alternatives if found.probability > LIKELY)


def check_health(residual: Residual, warming: float | None) -> HealthCheck:
    """Judge the residuals of a health check.

    Parameters
    ----------
    warming
        Temperature now less that of the calibration [K]; None if unknown.
    """
    whitened = residual.of(residual.model)
    chi_square, nu = float(whitened @ whitened), len(whitened)
    limit = float(chdtri(nu, FALSE_ALARM))
    miss = residual.whitener @ whitened
    found: tuple[Alternative, ...] = ()
    if chi_square > limit:
        found = explain(residual, movements(residual.model.n_joints, warming))
    return HealthCheck(
        chi_square=chi_square,
        nu=nu,
        p_value=float(chdtrc(nu, chi_square)),
        limit=limit,
        z=_as_normal(chi_square, nu),
        position_rms=float(np.sqrt((miss**2).mean() * 3)),
        alternatives=found,
    )


def explain(residual: Residual, candidates: tuple[Movement, ...]) -> tuple[Alternative, ...]:
    """All movements fitted and weighed, the most probable first."""
    fits = [_fit(residual, movement) for movement in candidates]
    families = [movement.family for movement in candidates]
    log_prior = -np.log([float(families.count(family)) for family in families])
    evidence = np.array([fit.evidence for fit in fits]) + log_prior
    probability = np.exp(evidence - logsumexp(evidence))
    found = [
        Alternative(movement, fit.numbers, fit.std, float(share), fit.p_value)
        for movement, fit, share in zip(candidates, fits, probability, strict=True)
    ]
    return tuple(sorted(found, key=lambda one: -one.probability))


def look_alike(
    first: Movement, second: Movement, residual: Residual, numbers: Float[Array, "number"]
) -> bool:
    """Whether the second movement can do at these poses what the first one did."""
    A, B = (derivatives(residual.model, movement, residual.q) for movement in (first, second))
    done = A @ numbers
    left = done - B @ np.linalg.lstsq(B, done, rcond=None)[0]
    return bool(np.linalg.norm(left) < _ALIKE * np.linalg.norm(done))


@dataclass(frozen=True)
class _Fit:
    numbers: Float[Array, "number"]
    std: Float[Array, "number"]
    evidence: float
    p_value: float


def _fit(residual: Residual, movement: Movement) -> _Fit:
    """Gauss-Newton, since a bump may be centimetres; evidence about the solution."""
    numbers = np.zeros(len(movement.sizes))
    for _ in range(_STEPS):
        model = moved(residual.model, movement, numbers)
        A = residual.whiten(derivatives(model, movement, residual.q))
        left = residual.of(model)
        numbers = numbers + np.linalg.lstsq(A, left, rcond=None)[0]
    left = residual.of(moved(residual.model, movement, numbers))
    A = residual.whiten(derivatives(moved(residual.model, movement, numbers), movement, residual.q))
    nu = len(left) - len(numbers)
    std = np.sqrt(np.diag(np.linalg.pinv(A.T @ A)))
    evidence = _evidence(left + A @ numbers, A, movement.sizes)
    return _Fit(numbers, std, evidence, float(chdtrc(nu, left @ left)))


def _evidence(
    whitened: Float[Array, "scalar"],
    A: Float[Array, "scalar number"],
    sizes: Float[Array, "number"],
) -> float:
    """Log marginal likelihood, averaged over the prior's widths."""
    log_density = []
    for width in _WIDTHS:
        B = A * (width * sizes)
        inner = np.eye(B.shape[1]) + B.T @ B
        seen = B.T @ whitened
        exponent = whitened @ whitened - seen @ np.linalg.solve(inner, seen)
        log_density.append(-0.5 * (exponent + np.linalg.slogdet(inner)[1]))
    return float(logsumexp(log_density) - np.log(len(_WIDTHS)))


def _as_normal(chi_square: float, nu: int) -> float:
    """Wilson and Hilferty's cube root (1931), accurate to 0.01 from five degrees of freedom."""
    spread = 2.0 / (9.0 * nu)
    return float((np.cbrt(chi_square / nu) - (1.0 - spread)) / np.sqrt(spread))
