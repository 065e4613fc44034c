"""Robot or station moves steadily.

p += d (t - start) / duration, along three axes.
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Instance,
    Moves,
    base_index,
)

PRIOR = 1.5e-4
"""Over the whole campaign [m]"""


class BaseDrift:
    """Robot or station moves steadily."""

    name = "base_drift"
    advice = (
        "let station and tripod settle, shield them from sun and draught, and re-measure fixed "
        "nests"
    )
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        coefficients = tuple(Coefficient(f"drift_{axis}_m", PRIOR) for axis in "xyz")
        return [Instance(self.name, None, (), coefficients)]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        first = base_index(rows)
        return {first + axis: rows.progress[:, None] * np.eye(3)[axis] for axis in range(3)}
