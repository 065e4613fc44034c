"""A joint was read before it stood still.

delta q_j = -kappa (q - q_before): what is left of the last move, more of it at higher speed.
"""

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    column,
    theta,
)

PRIOR = 1.5e-4
"""Share of the move that is left when the joint is read; [1]"""


class Settling:
    """A joint was read before it stood still."""

    name = "settling"
    follows = Follows.motion
    advice = "wait longer before reading, or move more slowly to the pose"
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        coefficient = Coefficient("rest_of_move", PRIOR)
        return [
            Instance(self.name, joint, (), (coefficient,)) for joint in range(1, rows.n_joints + 1)
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        move = (rows.joints - rows.previous)[:, instance.joint - 1]
        return {theta(instance.joint, rows): column(-move * rows.hurry)}
