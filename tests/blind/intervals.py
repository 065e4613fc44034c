"""Rates with intervals, and the law of detection."""

import math
from dataclasses import dataclass

import numpy as np

Z95 = 1.959964
"""Normal quantile of 97.5 %."""
RIDGE = 1e-3
"""Keeps the logistic fit finite where detected and missed do not overlap."""
RESAMPLES = 300


@dataclass(frozen=True)
class Rate:
    """So many of so many."""

    hits: int
    of: int

    @property
    def value(self) -> float:
        """Share; NaN of nothing."""
        return self.hits / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of Wilson, J. Am. Stat. Assoc. 22 (1927) 209."""
        if not self.of:
            return 0.0, 1.0
        p, n, z2 = self.value, self.of, Z95 * Z95
        centre = (p + z2 / (2 * n)) / (1 + z2 / n)
        half = Z95 / (1 + z2 / n) * math.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        return max(centre - half, 0.0), min(centre + half, 1.0)


def rate(hits: list[bool]) -> Rate:
    """Count."""
    return Rate(sum(hits), len(hits))


@dataclass(frozen=True)
class Estimate:
    """A number with its 95 % interval."""

    value: float
    interval: tuple[float, float]


def mean(values: list[float]) -> Estimate:
    """Mean with the interval of a normal mean."""
    if len(values) < 2:
        return Estimate(math.nan, (math.nan, math.nan))
    centre, half = float(np.mean(values)), Z95 * float(np.std(values, ddof=1)) / len(values) ** 0.5
    return Estimate(centre, (centre - half, centre + half))


def logistic(x: np.ndarray, hit: np.ndarray) -> tuple[float, float]:
    """Intercept and slope of log odds by Newton's method."""
    X = np.stack([np.ones_like(x), x], axis=1)
    b = np.zeros(2)
    for _ in range(60):
        p = 1.0 / (1.0 + np.exp(-np.clip(X @ b, -30, 30)))
        H = (X * (p * (1 - p))[:, None]).T @ X + RIDGE * np.eye(2)
        step = np.linalg.solve(H, X.T @ (hit - p) - RIDGE * b)
        b = b + np.clip(step, -5.0, 5.0)
        if np.abs(step).max() < 1e-9:
            break
    return float(b[0]), float(b[1])


def strength_at(x: list[float], detected: list[bool], chance: float = 0.95) -> Estimate:
    """The strength at which this share is detected, with its bootstrap interval."""
    strengths, hit = np.array(x), np.array(detected, dtype=float)
    if not 0.0 < hit.mean() < 1.0:
        return Estimate(math.nan, (math.nan, math.nan))
    rng = np.random.default_rng(1)

    def crossing(rows: np.ndarray) -> float:
        intercept, slope = logistic(strengths[rows], hit[rows])
        return (math.log(chance / (1 - chance)) - intercept) / slope if slope > 0 else math.nan

    everything = np.arange(len(hit))
    again = [crossing(rng.choice(everything, len(hit))) for _ in range(RESAMPLES)]
    low, high = np.nanpercentile(again, [2.5, 97.5])
    return Estimate(crossing(everything), (float(low), float(high)))
