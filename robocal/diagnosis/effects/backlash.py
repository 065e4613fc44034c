"""A joint stands off with the sign of its last motion.

delta q_j = -(b/2) sgn(last motion): lost motion of the gear.
"""

import numpy as np

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

PRIOR = 3e-4
"""30 to 300 microradian, up to a milliradian when worn [rad]; [m] where the joint is prismatic"""


class Backlash:
    """A joint stands off with the sign of its last motion."""

    name = "backlash"
    follows = Follows.motion
    advice = (
        "check the gear of this joint for play; approach targets from one side until it is mended"
    )
    needs = "approach1 ... approachn"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        return [
            Instance(self.name, joint, (), (Coefficient(f"width_{unit(joint, rows)}", PRIOR),))
            for joint in range(1, rows.n_joints + 1)
            if np.ptp(np.nan_to_num(rows.approach[:, joint - 1])) > 1
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        return {theta(instance.joint, rows): column(-0.5 * rows.side(instance.joint))}
