"""A joint stands off with the sign of its gravity torque.

delta q_j = (b/2) clip(tau_j / T, -1, 1): play that the load takes up. T is the torque that takes up
all of it, searched; 0 stands for the plain sign.
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

_TAKEN_UP = "taken_up_nm"
PRIOR = 3e-4
"""[rad]"""
SHARES = (0.0, 0.1)
"""Torques tried that take up all play, as shares of the largest of the joint; [1]"""
LEAST_SHARE = 0.04
"""Of the rows that must lie on either side of zero torque; [1]"""


class LoadBacklash:
    """A joint stands off with the sign of its gravity torque."""

    name = "load_backlash"
    follows = Follows.load
    advice = "check the gear of this joint for play"
    needs = "link masses in robot.yaml, or payload_kg"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        return [
            Instance(
                self.name,
                joint,
                ((_TAKEN_UP, share * float(np.abs(rows.torque[joint - 1]).max())),),
                (Coefficient("width_rad", PRIOR),),
            )
            for joint in revolute_joints(rows)
            if LEAST_SHARE < np.mean(rows.torque[joint - 1] > 0) < 1 - LEAST_SHARE
            for share in SHARES
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        assert instance.joint is not None
        torque = rows.torque[instance.joint - 1]
        # Models of before the torque was searched have none.
        taken_up = dict(instance.arguments).get(_TAKEN_UP, 0.0)
        side = np.clip(torque / taken_up, -1.0, 1.0) if taken_up > 0.0 else np.sign(torque)
        return {theta(instance.joint, rows): column(0.5 * side)}
