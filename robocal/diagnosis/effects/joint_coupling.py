"""One joint's angle leaks into another.

delta q_j = k q_l: a wrist whose gears share a path, or a parallelogram. Wrist joints are driven by
the wrist joints before them, joint 3 by joint 2.
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

PRIOR = 7e-4
"""Residual slip of a wrist's coupling; [1], or [m/rad], [rad/m] between joints of two kinds"""


class JointCoupling:
    """One joint's angle leaks into another."""

    name = "joint_coupling"
    follows = Follows.angle
    advice = "check the coupling factor in the controller's configuration"
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        n = rows.n_joints
        wrist = [(j, d) for j in range(max(n - 2, 2), n + 1) for d in range(n - 2, j) if d >= 1]
        pairs = {*wrist, (3, 2)} if n >= 3 else set(wrist)
        return [
            Instance(
                self.name,
                joint,
                (("driven_by", float(driver)),),
                (Coefficient(_name(unit(joint, rows), unit(driver, rows)), PRIOR),),
            )
            for joint, driver in sorted(pairs)
            if joint != driver
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        driver = int(instance.argument("driven_by"))
        return {theta(instance.joint, rows): column(rows.joints[:, driver - 1])}


def _name(driven: str, driver: str) -> str:
    """A pure number between joints of one kind."""
    return "coupling" if driven == driver else f"coupling_{driven}_per_{driver}"
