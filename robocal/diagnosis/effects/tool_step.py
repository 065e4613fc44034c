"""The nest or the tool slips at one moment.

p += R_flange d from one row on; every row is tried as the first one.
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    tool_index,
)
from robocal.diagnosis.steps import after_step, steps_of

PRIOR = 2e-4
"""[m]"""


class ToolStep:
    """The nest or the tool slips at one moment."""

    name = "tool_step"
    follows = Follows.time
    advice = "tighten nest and tool, then measure the tool again"
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        coefficients = tuple(Coefficient(f"step_{axis}_m", PRIOR) for axis in "xyz")
        return steps_of(self.name, None, coefficients, rows)

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        after = after_step(rows, instance)
        first = tool_index(rows)
        return {first + axis: after[:, None] * np.eye(3)[axis] for axis in range(3)}
