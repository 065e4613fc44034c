"""The trend of health checks: an exponentially weighted mean sees what no single check shows.

What the model never explained is the same in every check, so the checks are counted from the mean
of the first ones after a release; how uncertain that mean is widens the limit.
"""

from dataclasses import dataclass

import numpy as np

WEIGHT = 0.3
"""Of the newest check"""
FIRST = 5
"""Checks whose mean is what later ones are counted from"""
_SIGMAS = 3.0


@dataclass(frozen=True)
class TrendPoint:
    """The trend after a check."""

    ewma: float
    limit: float

    @property
    def alarm(self) -> bool:
        """Whether the drift is more than chance."""
        return self.ewma > self.limit


def trend(z: list[float]) -> TrendPoint | None:
    """The trend after the last of a version's checks; None while the first ones are gathered.

    Parameters
    ----------
    z
        Their statistics as standard normal ones, oldest first.
    """
    later = z[FIRST:]
    if not later:
        return None
    start, ewma = sum(z[:FIRST]) / FIRST, 0.0
    for value in later:
        ewma = WEIGHT * (value - start) + (1.0 - WEIGHT) * ewma
    kept = (1.0 - WEIGHT) ** len(later)
    variance = WEIGHT / (2.0 - WEIGHT) * (1.0 - kept**2) + (1.0 - kept) ** 2 / FIRST
    return TrendPoint(float(ewma), float(_SIGMAS * np.sqrt(variance)))
