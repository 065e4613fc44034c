"""What a hidden effect of the true cell is: four places at which it may act.

The controller believes its joint readings and its nominal geometry. An effect makes the truth
differ: in the joint angles, in the links, in where the base stands, in where the target sits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivers.emulators.rigid import Matrix
from drivers.emulators.true_arm import LinkTable, MassPoint, Vector


@dataclass(frozen=True)
class Circumstances:
    """Everything besides the joint readings that decides where the target truly is."""

    time_s: float
    """World time [s]."""
    temperature_degc: float
    payload_kg: float
    readings: int
    """How many measurements the tracker has taken before this one."""
    last_motion: tuple[int, ...]
    """Direction in which each joint last moved: -1, 0 (never moved), 1."""


@dataclass(frozen=True)
class Load:
    """Masses that the arm carries, each with the number of the link frame that it moves with."""

    bodies: tuple[tuple[int, MassPoint], ...]
    payload_frame: int
    payload_com: tuple[float, float, float]
    """Centre of the payload in the flange frame [m]."""
    gravity: tuple[float, float, float]
    """Acceleration in the base frame [m/s2]."""

    def with_payload(self, payload_kg: float) -> list[tuple[int, MassPoint]]:
        """Return the links' masses and the payload."""
        payload = (self.payload_frame, MassPoint(payload_kg, self.payload_com))
        return [*self.bodies, payload]


class Effect:
    """An effect that does nothing; each real one overrides the place at which it acts."""

    def joint_error(self, table: LinkTable, load: Load, q: Vector, now: Circumstances) -> Vector:
        """Return true joint position minus reading [rad], [m] for a prismatic joint."""
        del load, q, now
        return np.zeros(table.n_joints)

    def links(self, table: LinkTable, now: Circumstances) -> LinkTable:
        """Return the links as they are under these circumstances."""
        del now
        return table

    def base(self, T_tracker_base: Matrix, now: Circumstances) -> Matrix:
        """Return where the base stands in the tracker's frame."""
        del now
        return T_tracker_base

    def tool(self, T_flange_target: Matrix, now: Circumstances) -> Matrix:
        """Return where the target sits in the flange frame."""
        del now
        return T_flange_target


@dataclass(frozen=True)
class JointEffect(Effect):
    """An effect of one joint, counted from 1."""

    joint: int

    def at_joint(self, table: LinkTable, amount: float) -> Vector:
        """Return a joint error that is `amount` at this effect's joint and 0 elsewhere."""
        error = np.zeros(table.n_joints)
        error[self.joint - 1] = amount
        return error
