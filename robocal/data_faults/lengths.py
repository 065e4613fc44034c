"""Slips of the length unit of x_mm, y_mm, z_mm."""

from dataclasses import dataclass, replace

import numpy as np

from robocal.data_faults.slip import Fault, Slip
from robocal.formats.measurements_csv import POSITION
from robocal.measurements import MeasurementSet

_WRONG = {
    1e3: "are in metres",
    25.4: "are in inches",
    10.0: "are in centimetres",
    1e-3: "are in micrometres",
    1.0 / 25.4: "were multiplied by 25.4 once too often",
}
_NUMBERS = {1e3: "1000", 25.4: "25.4", 10.0: "10", 1e-3: "0.001", 1.0 / 25.4: "1/25.4"}
FACTORS = tuple(_WRONG)
"""What positions may have to be multiplied by [1]"""


@dataclass(frozen=True)
class LengthFactor:
    """Positions that were meant = factor times those of the file."""

    factor: float

    def __call__(self, rows: MeasurementSet) -> MeasurementSet:
        """The rows with these positions."""
        return replace(rows, position=rows.position * self.factor)


def length_slip(factor: float) -> Slip:
    """The slip that multiplying the positions by one of `FACTORS` mends."""
    return Slip(
        Fault.unit,
        POSITION,
        f"{', '.join(POSITION)} {_WRONG[factor]}: multiply by {_NUMBERS[factor]}",
        LengthFactor(factor),
    )


def nearest_factor(scale: float) -> float:
    """The factor of a known unit that is nearest to a fitted scale, 1 included."""
    known = np.array([1.0, *FACTORS])
    return float(known[np.argmin(np.abs(np.log(known / max(scale, 1e-9))))])
