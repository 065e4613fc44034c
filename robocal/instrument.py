"""Standard uncertainty of one reading, from what the data sheets and the repeats state."""

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
    repeatability
        Of the robot: how far the target is off when the same pose is visited again [m].
    orientation_repeatability
        The same for each component of the rotation vector [rad].
    target
        Of the reflector's centre in its nest [m].
    """

    fixed: float
    per_range: float = 0.0
    orientation: float = 5e-5
    repeatability: float = 0.0
    orientation_repeatability: float = 0.0
    target: float = 0.0

    def position_std(self, position: Float[Array, "row 3"]) -> Float[Array, "row"]:
        """Standard deviation of each coordinate of each position [m]."""
        return self.distance_std(np.linalg.norm(position, axis=1))

    def distance_std(self, distance: Float[Array, "row"]) -> Float[Array, "row"]:
        """Standard deviation of a coordinate or length at a range [m]."""
        constant = np.sqrt(self.fixed**2 + self.repeatability**2 + self.target**2)
        return np.asarray(np.hypot(constant, self.per_range * distance))

    def orientation_std(self) -> float:
        """Standard deviation of each component of the rotation vector [rad]."""
        return float(np.hypot(self.orientation, self.orientation_repeatability))
