"""Hidden effects that act on joints: the true joint position differs from the reading."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.emulators.effect import Circumstances, JointEffect, Load
from drivers.emulators.true_arm import LinkTable, Vector, gravity_loads


@dataclass(frozen=True)
class JointCompliance(JointEffect):
    """The joint yields to gravity: error = compliance x gravity load of links and payload."""

    compliance_rad_per_nm: float
    """[rad/(N m)], [m/N] for a prismatic joint."""

    def joint_error(self, table: LinkTable, load: Load, q: Vector, now: Circumstances) -> Vector:
        """Return compliance times the gravity load about the joint's axis."""
        loads = gravity_loads(table, q, load.with_payload(now.payload_kg), np.array(load.gravity))
        return self.at_joint(table, self.compliance_rad_per_nm * float(loads[self.joint - 1]))


@dataclass(frozen=True)
class GearHarmonic(JointEffect):
    """Periodic transmission error: error = amplitude x sin(order x q + phase)."""

    order: float
    """Cycles per turn of the joint, a real number."""
    amplitude_mrad: float
    phase_deg: float = 0.0

    def joint_error(self, table: LinkTable, load: Load, q: Vector, now: Circumstances) -> Vector:
        """Return the transmission error at the present joint angle."""
        del load, now
        angle = self.order * float(q[self.joint - 1]) + math.radians(self.phase_deg)
        return self.at_joint(table, self.amplitude_mrad * 1e-3 * math.sin(angle))


@dataclass(frozen=True)
class Backlash(JointEffect):
    """Lost motion: error = -(width / 2) x direction in which the joint last moved."""

    width_mrad: float

    def joint_error(self, table: LinkTable, load: Load, q: Vector, now: Circumstances) -> Vector:
        """Return half the width against the last motion; 0 while the joint has never moved."""
        del load, q
        direction = now.last_motion[self.joint - 1]
        return self.at_joint(table, -0.5e-3 * self.width_mrad * direction)
