"""Whether the law of propagation may stand for the Monte Carlo method in the same case.

References
----------
.. [1] JCGM 101:2008, 8.1.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.uncertainty.coverage import Interval, numerical_tolerance


@dataclass(frozen=True)
class Agreement:
    """Distances of the two intervals' ends, in the unit of the output."""

    low: Float[Array, "output"]
    high: Float[Array, "output"]
    tolerance: Float[Array, "output"]

    @property
    def validated(self) -> Bool[Array, "output"]:
        """Both ends within the tolerance: the law of propagation is good here."""
        return np.asarray((self.low <= self.tolerance) & (self.high <= self.tolerance))


def compare(
    estimate: Float[Array, "output"],
    std: Float[Array, "output"],
    expanded: Float[Array, "output"],
    drawn: Interval,
    digits: int,
) -> Agreement:
    """Compare `estimate` ± `expanded` with the interval of the draws.

    Parameters
    ----------
    std
        Standard uncertainty by the law of propagation, which sets the tolerance.
    digits
        Significant digits of it that count.
    """
    return Agreement(
        low=np.abs(estimate - expanded - drawn.low),
        high=np.abs(estimate + expanded - drawn.high),
        tolerance=numerical_tolerance(std, digits),
    )
