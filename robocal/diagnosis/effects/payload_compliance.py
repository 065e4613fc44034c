"""A joint yields to the payload only: the controller already compensates the links.

delta q_j = c tau_j of the payload.
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    column,
    revolute_joints,
    theta,
)
from robocal.diagnosis.load_size import joint_compliance_of, weight_of

YIELD = 1e-3
"""Of the joint that carries most of it, under its largest torque by the payload [rad]"""
LEAST_TORQUE = 0.05
"""[Nm]"""


class PayloadCompliance:
    """A joint yields to the payload only: the controller already compensates the links."""

    name = "payload_compliance"
    follows = Follows.load
    advice = (
        "the controller's load data: state mass and centre of the payload there; compensate the "
        "rest"
    )
    needs = "payload_kg, at least two loads"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        if not rows.has_payload:
            return []
        loads, name = rows.payload_torque, "compliance_rad_per_nm"
        return [
            Instance(
                self.name,
                joint,
                (),
                (Coefficient(name, joint_compliance_of(YIELD, loads, joint)),),
                weight_of(loads[joint - 1]),
            )
            for joint in revolute_joints(rows)
            if np.ptp(loads[joint - 1]) > LEAST_TORQUE
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        return {theta(instance.joint, rows): column(rows.payload_torque[instance.joint - 1])}
