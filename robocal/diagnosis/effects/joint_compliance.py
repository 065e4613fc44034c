"""A joint yields to the gravity torque of links and payload.

delta q_j = c tau_j(q, payload): the gear behaves as a torsional spring. Without link masses the
torque has one unknown number for the end of every long link; see `unknown_masses.py`.
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    revolute_joints,
    theta,
)
from robocal.diagnosis.load_size import joint_compliance_of, weight_of
from robocal.diagnosis.unknown_masses import (
    point_of,
    torques_of_unit_masses,
    unit_mass_coefficients,
)

_COMPLIANCE = "compliance_rad_per_nm"
YIELD = 1.5e-3
"""Of the joint that carries most, under its largest torque: tenths of a millimetre to a millimetre
at the tip [rad]"""
PRIOR = 2e-5
"""Where masses are unknown: 10 to 100 microradian a newton metre in small arms [rad/Nm]"""
LEAST_TORQUE = 0.05
"""A joint whose gravity torque varies less than this is not loaded [Nm]"""


class JointCompliance:
    """A joint yields to the gravity torque of links and payload."""

    name = "joint_compliance"
    follows = Follows.load
    advice = (
        "stiffness of the joint's gear: compare with its data sheet; compensate with this model, "
        "or reduce the load"
    )
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        found = [
            Instance(self.name, joint, (), self._coefficients(rows, joint), _weight(rows, joint))
            for joint in revolute_joints(rows)
        ]
        return [instance for instance in found if instance.coefficients]

    def _coefficients(self, rows: Circumstances, joint: int) -> tuple[Coefficient, ...]:
        """One where the masses are stated, else one for every place of an unknown mass."""
        if rows.robot.masses is not None:
            if np.ptp(rows.torque[joint - 1]) <= LEAST_TORQUE:
                return ()
            return (Coefficient(_COMPLIANCE, joint_compliance_of(YIELD, rows.torque, joint)),)
        loads = torques_of_unit_masses(rows, joint)
        unknown = unit_mass_coefficients("compliance", PRIOR, loads, LEAST_TORQUE)
        known = (Coefficient(_COMPLIANCE, PRIOR),) if rows.has_payload else ()
        return (*unknown, *known) if unknown else ()

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        points = [point_of(coefficient) for coefficient in instance.coefficients]
        loads = torques_of_unit_masses(rows, instance.joint) if any(points) else {}
        torque = rows.torque[instance.joint - 1]
        patterns = [loads[point] if point else torque for point in points]
        return {theta(instance.joint, rows): np.stack(patterns, axis=1)}


def _weight(rows: Circumstances, joint: int) -> float:
    """Prior weight of a joint; all alike where the masses are unknown."""
    return 1.0 if rows.robot.masses is None else weight_of(rows.torque[joint - 1])
