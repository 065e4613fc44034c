"""A joint's zero moves with temperature.

delta q_j = k (T - mean T): the heat of a gearbox.
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

PRIOR = 5e-6
"""10 to 100 microradian over a warm-up [rad/K]; [m/K] where the joint is prismatic"""


class JointThermalDrift:
    """A joint's zero moves with temperature."""

    name = "joint_thermal_drift"
    follows = Follows.time
    advice = "warm the joint up before work, check lubrication and fan"
    needs = "temperature_degc, varying"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        if not rows.has_temperature:
            return []
        return [
            Instance(self.name, joint, (), (_coefficient(joint, rows),))
            for joint in range(1, rows.n_joints + 1)
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        return {theta(instance.joint, rows): column(rows.warmer)}


def _coefficient(joint: int, rows: Circumstances) -> Coefficient:
    return Coefficient(f"drift_{unit(joint, rows)}_per_k", PRIOR)
