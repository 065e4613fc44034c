"""A joint yields to the payload only: the controller already compensates the links.

delta q_j = c tau_j of the payload.
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

PRIOR = 3e-5
"""[rad/Nm]"""
LEAST_TORQUE = 0.05
"""[Nm]"""


class PayloadCompliance:
    """A joint yields to the payload only: the controller already compensates the links."""

    name = "payload_compliance"
    advice = (
        "the controller's load data: state mass and centre of the payload there; compensate the "
        "rest"
    )
    needs = "payload_kg, at least two loads"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        if not rows.has_payload:
            return []
        coefficient = Coefficient("compliance_rad_per_nm", PRIOR)
        return [
            Instance(self.name, joint, (), (coefficient,))
            for joint in revolute_joints(rows)
            if np.ptp(rows.payload_torque[joint - 1]) > LEAST_TORQUE
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        return {theta(instance.joint, rows): column(rows.payload_torque[instance.joint - 1])}
