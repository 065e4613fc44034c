"""A joint stands off with the sign of its gravity torque.

delta q_j = (b/2) sgn(tau_j): play that the load takes up.
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Instance,
    Moves,
    column,
    revolute_joints,
    theta,
)

PRIOR = 3e-4
"""[rad]"""
LEAST_SHARE = 0.04
"""Of the rows that must lie on either side of zero torque; [1]"""


class LoadBacklash:
    """A joint stands off with the sign of its gravity torque."""

    name = "load_backlash"
    advice = "check the gear of this joint for play"
    needs = "link masses in robot.yaml, or payload_kg"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        coefficient = Coefficient("width_rad", PRIOR)
        return [
            Instance(self.name, joint, (), (coefficient,))
            for joint in revolute_joints(rows)
            if LEAST_SHARE < np.mean(rows.torque[joint - 1] > 0) < 1 - LEAST_SHARE
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        return {theta(instance.joint, rows): column(0.5 * np.sign(rows.torque[instance.joint - 1]))}
