"""Standard uncertainty of one reading, from what the instrument's data sheet states."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


@dataclass(frozen=True)
class InstrumentNoise:
    """One standard deviation, per axis.

    Parameters
    ----------
    fixed
        Part of the position that does not depend on range [m].
    per_range
        Part that grows with the range from the instrument [m/m].
    orientation
        Of each component of the rotation vector [rad].
    """

    fixed: float
    per_range: float = 0.0
    orientation: float = 5e-5

    def position_std(self, position: Float[Array, "row 3"]) -> Float[Array, "row"]:
        """Standard deviation of each coordinate of each position [m]."""
        ranges = np.linalg.norm(position, axis=1)
        return np.asarray(np.hypot(self.fixed, self.per_range * ranges))
