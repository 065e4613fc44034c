"""A joint yields to the gravity torque of links and payload.

delta q_j = c tau_j(q, payload): the gear behaves as a torsional spring. Without link masses only
the payload's torque is known, and the effect is the same as `payload_compliance`.
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

PRIOR = 2e-5
"""Small arms and cobots: 10 to 100 microradian a newton metre, large ones less [rad/Nm]"""
LEAST_TORQUE = 0.05
"""A joint whose gravity torque varies less than this is not loaded [Nm]"""


class JointCompliance:
    """A joint yields to the gravity torque of links and payload."""

    name = "joint_compliance"
    advice = (
        "stiffness of the joint's gear: compare with its data sheet; compensate with this model, "
        "or reduce the load"
    )
    needs = "link masses in robot.yaml"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        if rows.robot.masses is None:
            return []
        coefficient = Coefficient("compliance_rad_per_nm", PRIOR)
        return [
            Instance(self.name, joint, (), (coefficient,))
            for joint in revolute_joints(rows)
            if np.ptp(rows.torque[joint - 1]) > LEAST_TORQUE
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        return {theta(instance.joint, rows): column(rows.torque[instance.joint - 1])}
