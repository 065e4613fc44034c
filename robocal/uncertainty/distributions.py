"""Probability distributions that JCGM 101 assigns to input quantities, table 1.

Each states its estimate (expectation), standard uncertainty and degrees of freedom, and draws.

References
----------
.. [1] JCGM 101:2008, 6.4.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


@runtime_checkable
class Distribution(Protocol):
    """What is known of one input quantity, in any one unit."""

    @property
    def estimate(self) -> float:
        """Best estimate: the expectation."""
        ...

    @property
    def std(self) -> float:
        """Standard uncertainty."""
        ...

    @property
    def nu(self) -> float:
        """Degrees of freedom behind the standard uncertainty; infinite where it is certain."""
        ...

    def draw(self, rng: np.random.Generator, count: int) -> Float[Array, "draw"]:
        """So many draws."""
        ...


@dataclass(frozen=True)
class Normal:
    """Gaussian; `nu` only where the standard uncertainty is itself uncertain (GUM, G.4.2)."""

    estimate: float
    std: float
    nu: float = float("inf")

    def draw(self, rng: np.random.Generator, count: int) -> Float[Array, "draw"]:
        """JCGM 101, 6.4.7."""
        return rng.normal(self.estimate, self.std, count)


@dataclass(frozen=True)
class ScaledT:
    """What a mean of nu + 1 readings with standard deviation of the mean `std` says."""

    estimate: float
    std: float
    nu: float

    def draw(self, rng: np.random.Generator, count: int) -> Float[Array, "draw"]:
        """JCGM 101, 6.4.9: heavier tails than `std` alone would have."""
        return self.estimate + self.std * rng.standard_t(self.nu, count)


@dataclass(frozen=True)
class Rectangular:
    """Anywhere between two limits."""

    low: float
    high: float
    nu: float = float("inf")

    @property
    def estimate(self) -> float:
        """Middle of the limits."""
        return 0.5 * (self.low + self.high)

    @property
    def std(self) -> float:
        """GUM, 4.3.7."""
        return (self.high - self.low) / float(np.sqrt(12.0))

    def draw(self, rng: np.random.Generator, count: int) -> Float[Array, "draw"]:
        """JCGM 101, 6.4.2."""
        return rng.uniform(self.low, self.high, count)


@dataclass(frozen=True)
class Trapezoidal:
    """Sum of two rectangular quantities; `top` = 0 is the triangle, 1 the rectangle."""

    low: float
    high: float
    top: float
    nu: float = float("inf")

    @property
    def estimate(self) -> float:
        """Middle of the limits."""
        return 0.5 * (self.low + self.high)

    @property
    def std(self) -> float:
        """GUM, 4.3.9."""
        return 0.5 * (self.high - self.low) * float(np.sqrt((1.0 + self.top**2) / 6.0))

    def draw(self, rng: np.random.Generator, count: int) -> Float[Array, "draw"]:
        """JCGM 101, 6.4.4."""
        first, second = rng.random((2, count))
        half = 0.5 * (self.high - self.low)
        return np.asarray(self.low + half * ((1.0 + self.top) * first + (1.0 - self.top) * second))


@dataclass(frozen=True)
class CurvilinearTrapezoid:
    """Between limits that are themselves known only within ± `blur`."""

    low: float
    high: float
    blur: float
    nu: float = float("inf")

    @property
    def estimate(self) -> float:
        """Middle of the limits."""
        return 0.5 * (self.low + self.high)

    @property
    def std(self) -> float:
        """JCGM 101, 6.4.3.3."""
        width = self.high - self.low
        return float(np.sqrt(width**2 / 12.0 + self.blur**2 / 9.0))

    def draw(self, rng: np.random.Generator, count: int) -> Float[Array, "draw"]:
        """JCGM 101, 6.4.3.4: a lower limit, the upper one that mirrors it, a point between."""
        first, second = rng.random((2, count))
        low = self.low - self.blur + 2.0 * self.blur * first
        high = self.low + self.high - low
        return np.asarray(low + (high - low) * second)


@dataclass(frozen=True)
class ArcSine:
    """Cycles sinusoidally between two limits, at an unknown phase."""

    low: float
    high: float
    nu: float = float("inf")

    @property
    def estimate(self) -> float:
        """Middle of the limits."""
        return 0.5 * (self.low + self.high)

    @property
    def std(self) -> float:
        """JCGM 101, 6.4.6.3."""
        return (self.high - self.low) / float(np.sqrt(8.0))

    def draw(self, rng: np.random.Generator, count: int) -> Float[Array, "draw"]:
        """JCGM 101, 6.4.6.4."""
        phase = 2.0 * np.pi * rng.random(count)
        return np.asarray(self.estimate + 0.5 * (self.high - self.low) * np.sin(phase))
