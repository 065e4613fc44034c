"""Hidden effects that act on a joint's reading: the true joint position differs from it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivers.emulators.effect import JointEffect
from drivers.emulators.moment import has_come
from drivers.emulators.stance import Stance
from drivers.emulators.true_arm import Vector


@dataclass(frozen=True)
class GearHarmonic(JointEffect):
    """Periodic transmission error: error = amplitude x sin(order x q + phase)."""

    order: float
    """Cycles per turn of the joint, a real number."""
    amplitude_mrad: float
    phase_deg: float = 0.0
    neighbour_order: float = 0.0
    """A second harmonic beside it."""
    neighbour_share: float = 0.0
    """Its amplitude over that of the first."""

    def joint_error(self, stance: Stance) -> Vector:
        """Return the transmission error at the present joint angle."""
        q, phase = stance.q[..., self.joint - 1], math.radians(self.phase_deg)
        wave = np.sin(self.order * q + phase)
        wave = wave + self.neighbour_share * np.cos(self.neighbour_order * q - phase)
        return self.at_joint(stance, self.amplitude_mrad * 1e-3 * wave)


@dataclass(frozen=True)
class EncoderGain(JointEffect):
    """The reading is off by a factor: error = gain x q (1 + unevenness x q)."""

    gain_ppm: float
    unevenness_per_rad: float = 0.0

    def joint_error(self, stance: Stance) -> Vector:
        """Return the share of the reading that is missing."""
        q = stance.q[..., self.joint - 1]
        return self.at_joint(stance, self.gain_ppm * 1e-6 * q * (1.0 + self.unevenness_per_rad * q))


@dataclass(frozen=True)
class JointCoupling(JointEffect):
    """One joint leaks into this one: error = coupling x (q of the driver + ripple x sin 2q)."""

    driven_by: int
    coupling_mrad_per_rad: float
    ripple: float = 0.0

    def joint_error(self, stance: Stance) -> Vector:
        """Return the share of the driving joint's angle."""
        q = stance.q[..., self.driven_by - 1]
        leak = q + self.ripple * np.sin(2.0 * q)
        return self.at_joint(stance, self.coupling_mrad_per_rad * 1e-3 * leak)


@dataclass(frozen=True)
class Backlash(JointEffect):
    """Lost motion: error = -(width / 2) x direction in which the joint last moved."""

    width_mrad: float
    uneven_share: float = 0.0
    """How much the width varies over a turn of the joint, as a share of it."""

    def joint_error(self, stance: Stance) -> Vector:
        """Return half the width against the last motion; 0 while the joint has never moved."""
        direction = stance.now.last_motion[..., self.joint - 1]
        width = 1.0 + self.uneven_share * np.cos(stance.q[..., self.joint - 1])
        return self.at_joint(stance, -0.5e-3 * self.width_mrad * direction * width)


@dataclass(frozen=True)
class Settling(JointEffect):
    """Read before it stood still: error = -rest x last move x speed ratio x exp(-waited / tau).

    `rest_ppm` is what is left of a move at `full_speed` after the arm has stood `waited_s`.
    """

    rest_ppm: float
    time_constant_s: float = 0.5
    waited_s: float = 1.0
    full_speed: float = 1.0
    """[rad/s]"""

    def joint_error(self, stance: Stance) -> Vector:
        """Return the part of the last move that has not been made yet."""
        now = stance.now
        fading = np.exp((self.waited_s - now.settled_s) / self.time_constant_s)
        rest = self.rest_ppm * 1e-6 * now.speed / self.full_speed * fading
        return self.at_joint(stance, -rest * now.last_move[..., self.joint - 1])


@dataclass(frozen=True)
class JointThermalDrift(JointEffect):
    """The heat of a gearbox moves the joint's zero: error = drift x dT (1 + bend x dT)."""

    drift_urad_per_k: float
    reference_degc: float = 20.0
    bend_per_k: float = 0.0

    def joint_error(self, stance: Stance) -> Vector:
        """Return the drift at the present temperature."""
        warmer = np.asarray(stance.now.temperature_degc - self.reference_degc)
        drift = self.drift_urad_per_k * 1e-6 * warmer * (1.0 + self.bend_per_k * warmer)
        return self.at_joint(stance, drift)


@dataclass(frozen=True)
class EncoderStep(JointEffect):
    """The joint's zero jumps, at a world time or after a number of readings."""

    step_mrad: float
    at_s: float = math.inf
    after_readings: float = math.inf
    creep_s: float = 0.0
    """Time constant with which it arrives; 0 jumps."""

    def joint_error(self, stance: Stance) -> Vector:
        """Return the jump once its moment has come."""
        share = has_come(stance.now, self.at_s, self.after_readings, self.creep_s)
        return self.at_joint(stance, self.step_mrad * 1e-3 * share)
