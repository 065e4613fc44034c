"""A joint's zero jumps at one moment.

delta q_j from one row on; every row is tried as the first one.
"""

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    column,
    theta,
    unit,
)
from robocal.diagnosis.steps import after_step, steps_of

PRIOR = 3e-4
"""[rad]; [m] where the joint is prismatic"""


class EncoderStep:
    """A joint's zero jumps at one moment."""

    name = "encoder_step"
    follows = Follows.time
    advice = "check the encoder's cable and coupling, and master the joint again"
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        found: list[Instance] = []
        for joint in range(1, rows.n_joints + 1):
            coefficient = Coefficient(f"step_{unit(joint, rows)}", PRIOR)
            found += steps_of(self.name, joint, (coefficient,), rows)
        return found

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        return {theta(instance.joint, rows): column(after_step(rows, instance))}
