"""The instrument's angle encoders err, second order.

delta az = A cos 2az + B sin 2az, and the same in elevation: eccentric or tilted circles.
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    base_index,
)

PRIOR = 8e-6
"""15 micrometres and 6 micrometres a metre, typical half, at 2 m [rad]"""


class InstrumentAngle:
    """The instrument's angle encoders err, second order."""

    name = "instrument_angle"
    follows = Follows.sight
    advice = "compensate the instrument by its own field check; measure from a second station"
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        names = ("az_cos", "az_sin", "el_cos", "el_sin")
        return [Instance(self.name, None, (), tuple(Coefficient(f"{n}_rad", PRIOR) for n in names))]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        p = rows.position
        azimuth = np.arctan2(p[:, 1], p[:, 0])
        level = np.hypot(p[:, 0], p[:, 1])
        elevation = np.arctan2(p[:, 2], level)
        turned = np.stack([-p[:, 1], p[:, 0], np.zeros(len(p))], axis=1)
        raised = np.stack([-p[:, 2] * np.cos(azimuth), -p[:, 2] * np.sin(azimuth), level], axis=1)
        shifts = [
            turned * np.cos(2 * azimuth)[:, None],
            turned * np.sin(2 * azimuth)[:, None],
            raised * np.cos(2 * elevation)[:, None],
            raised * np.sin(2 * elevation)[:, None],
        ]
        # A shift of the point is a shift of the base, written along the base's own axes.
        along = np.stack([shift @ rows.base_rotation for shift in shifts], axis=2)
        first = base_index(rows)
        return {first + axis: along[:, axis] for axis in range(3)}
