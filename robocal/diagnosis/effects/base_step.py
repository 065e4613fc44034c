"""Robot or station is bumped at one moment.

p += d from one row on; every row is tried as the first one.
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
from robocal.diagnosis.steps import after_step, steps_of

PRIOR = 2e-4
"""[m]"""


class BaseStep:
    """Robot or station is bumped at one moment."""

    name = "base_step"
    follows = Follows.time
    advice = "look for what was bumped at that time; fasten it and re-measure fixed nests"
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        coefficients = tuple(Coefficient(f"step_{axis}_m", PRIOR) for axis in "xyz")
        return steps_of(self.name, None, coefficients, rows)

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        after = after_step(rows, instance)
        first = base_index(rows)
        return {first + axis: after[:, None] * np.eye(3)[axis] for axis in range(3)}
