"""What a hidden effect of the true cell is: the places at which it may act.

The controller believes its joint readings and its nominal geometry. An effect makes the truth
differ: in the joint angles, in the links and what lies between them, in where the base stands, in
where the target sits, in what the instrument sees. Everything may be a stack of rows (`...`): the
world asks for one moment, a whole campaign is asked at once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivers.emulators.rigid import Matrix
from drivers.emulators.stance import Circumstances, Stance
from drivers.emulators.true_arm import LinkTable, Vector


class Effect:
    """An effect that does nothing; each real one overrides the place at which it acts."""

    def joint_error(self, stance: Stance) -> Vector:
        """Return true joint position minus reading [rad], [m] for a prismatic joint."""
        return np.zeros_like(stance.q)

    def links(self, table: LinkTable, now: Circumstances) -> LinkTable:
        """Return the links as they are under these circumstances."""
        del now
        return table

    def flexures(self, stance: Stance) -> Mapping[int, Matrix]:
        """Return small motions between links, by the number of the frame that they follow."""
        del stance
        return {}

    def base(self, T_tracker_base: Matrix, stance: Stance) -> Matrix:
        """Return where the base stands in the tracker's frame."""
        del stance
        return T_tracker_base

    def tool(self, T_flange_target: Matrix, stance: Stance) -> Matrix:
        """Return where the target sits in the flange frame."""
        del stance
        return T_flange_target

    def seen(self, T_tracker_target: Matrix) -> Vector:
        """Return how far from the target the instrument sees it, in its frame [m]."""
        return np.zeros_like(T_tracker_target[..., :3, 3])


@dataclass(frozen=True)
class JointEffect(Effect):
    """An effect of one joint, counted from 1."""

    joint: int

    def at_joint(self, stance: Stance, amount: Vector) -> Vector:
        """Return a joint error that is `amount` at this effect's joint and 0 elsewhere."""
        error = np.zeros_like(stance.q)
        error[..., self.joint - 1] = amount
        return error
