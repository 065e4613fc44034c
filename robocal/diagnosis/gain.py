"""What the effects gain on rows that chose nothing, and by blocked folds on those that did."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

_RESAMPLES = 2000
_MOST_DRAWN = 200
"""Poses that are drawn one by one; more are drawn in so many even groups; [1]"""
_FOLDS = 5
_SEED = 1


@dataclass(frozen=True)
class Gain:
    """RMS of the position residual before and after [m]."""

    before: float
    after: float
    ci95: tuple[float, float]
    """Interval of the reduction; [1]"""
    poses: int

    @property
    def reduction(self) -> float:
        """Share of the RMS that is gone."""
        return 1.0 - self.after / self.before if self.before > 0 else 0.0


def gain_of(
    before: Float[Array, "row"], after: Float[Array, "row"], pose: Int[Array, "row"]
) -> Gain:
    """Reduction of the RMS distance, its interval from resampled poses.

    Parameters
    ----------
    before, after
        Distance of each row's target from its prediction [m].
    pose
        Number of the pose; rows of one pose are drawn together.
    """
    _, number = np.unique(pose, return_inverse=True)
    n = int(number.max()) + 1 if len(number) else 0
    if n == 0:
        return Gain(0.0, 0.0, (0.0, 0.0), 0)
    sums = np.stack([np.bincount(number, values**2, n) for values in (before, after)])
    groups = min(n, _MOST_DRAWN)
    together = np.stack([np.bincount(np.arange(n) % groups, column, groups) for column in sums])
    drawn = np.random.default_rng(_SEED).integers(0, groups, size=(_RESAMPLES, groups))
    totals = together[:, drawn].sum(axis=2)
    reductions = 1.0 - np.sqrt(totals[1] / np.maximum(totals[0], 1e-300))
    low, high = np.quantile(reductions, [0.025, 0.975])
    rms = np.sqrt(sums.sum(axis=1) / len(before))
    return Gain(float(rms[0]), float(rms[1]), (float(low), float(high)), n)


def blocks_of(pose: Int[Array, "row"]) -> Int[Array, "row"]:
    """Runs of poses in file order, as folds."""
    _, first, number = np.unique(pose, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[number] * _FOLDS // len(first)
