"""The true cell without clock or devices: where the target is, and where it is seen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.emulators.effect import Effect
from drivers.emulators.rigid import Matrix
from drivers.emulators.stance import Circumstances, Load, Stance
from drivers.emulators.true_arm import LinkTable, Vector, link_frames


@dataclass(frozen=True)
class HiddenCell:
    """True geometry, frames, masses and hidden effects."""

    table: LinkTable
    base: Matrix
    """In the tracker's frame."""
    tool: Matrix
    """Target in the flange frame."""
    load: Load
    effects: tuple[Effect, ...]

    def true_joints(self, q: Vector, now: Circumstances) -> Vector:
        """Joint positions that the arm really has at these readings, scatter apart."""
        return self._true_joints(Stance(self.table, self.load, q, now))

    def _true_joints(self, stance: Stance) -> Vector:
        errors = (effect.joint_error(stance) for effect in self.effects)
        return np.asarray(stance.q + sum(errors, np.zeros_like(stance.q)))

    def target_pose(self, q: Vector, now: Circumstances, scatter: Vector) -> Matrix:
        """Where the target truly is in the tracker's frame, (..., 4, 4).

        Parameters
        ----------
        q, now
            Joint readings, (..., joint), and what goes with them.
        scatter
            By how much the joints have missed their place this time.
        """
        stance = Stance(self.table, self.load, q, now)
        table, base, tool = self.table, self.base, self.tool
        bent: dict[int, Matrix] = {}
        for effect in self.effects:
            table = effect.links(table, now)
            base, tool = effect.base(base, stance), effect.tool(tool, stance)
            for frame, motion in effect.flexures(stance).items():
                bent[frame] = bent[frame] @ motion if frame in bent else motion
        flange = link_frames(table, self._true_joints(stance) + scatter, bent)[-1]
        return np.asarray(base @ flange @ tool)

    def base_now(self, q: Vector, now: Circumstances) -> Matrix:
        """Where the base stands in the tracker's frame at this moment."""
        stance = Stance(self.table, self.load, q, now)
        base = self.base
        for effect in self.effects:
            base = effect.base(base, stance)
        return base

    def seen(self, T_tracker_target: Matrix) -> Vector:
        """Where the instrument sees the target, noise apart [m]."""
        shifts = (effect.seen(T_tracker_target) for effect in self.effects)
        return np.asarray(sum(shifts, T_tracker_target[..., :3, 3]))
