"""Hidden effects that the catalogue of causes does not hold: a diagnosis must not name one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivers.emulators.effect import Effect, JointEffect
from drivers.emulators.rigid import Matrix, small_motion, translation
from drivers.emulators.stance import Stance
from drivers.emulators.true_arm import Vector


@dataclass(frozen=True)
class Hysteresis(JointEffect):
    """Drag of hoses and seals: a play of `loop_rad` follows the joint, and pulls it back.

    error = -(height / 2) x (q - w) / loop, w the play's state over all stops so far.
    """

    height_mrad: float
    loop_rad: float

    def joint_error(self, stance: Stance) -> Vector:
        """Return the drag at the stop where the arm stands."""
        path = stance.now.stops[:, self.joint - 1]
        state = np.empty(len(path))
        w = path[0]
        for k, q in enumerate(path):
            w = min(max(w, q - self.loop_rad), q + self.loop_rad)
            state[k] = w
        drag = (stance.q[..., self.joint - 1] - state[stance.now.stop]) / self.loop_rad
        return self.at_joint(stance, -0.5e-3 * self.height_mrad * np.clip(drag, -1.0, 1.0))


@dataclass(frozen=True)
class AxisWobble(JointEffect):
    """A worn bearing: the axis tilts and shifts twice a turn, around with the joint."""

    tilt_urad: float
    shift_um: float
    phase_deg: float = 0.0

    def flexures(self, stance: Stance) -> Mapping[int, Matrix]:
        """Return tilt and shift of the axis, before the joint turns."""
        angle = 2.0 * stance.q[..., self.joint - 1] + math.radians(self.phase_deg)
        round_ = np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
        shift = self.shift_um * 1e-6 * round_
        return {self.joint - 1: small_motion(shift, self.tilt_urad * 1e-6 * round_)}


@dataclass(frozen=True)
class StiffeningCompliance(JointEffect):
    """Two slopes: the joint yields easily to small loads, hardly to those above `knee_nm`."""

    soft_rad_per_nm: float
    knee_nm: float
    stiff_share: float = 0.2

    def joint_error(self, stance: Stance) -> Vector:
        """Return the angle on the broken line."""
        load = stance.loads[..., self.joint - 1]
        low = np.clip(load, -self.knee_nm, self.knee_nm)
        return self.at_joint(stance, self.soft_rad_per_nm * (low + self.stiff_share * (load - low)))


@dataclass(frozen=True)
class BearingCompliance(JointEffect):
    """The joint's bearing yields across its axis to the moment across it."""

    compliance_rad_per_nm: float

    def flexures(self, stance: Stance) -> Mapping[int, Matrix]:
        """Return the tilt of the axis, before the joint turns."""
        before = self.joint - 1
        back = np.swapaxes(stance.frames[before][..., :3, :3], -1, -2)
        moment = (back @ stance.moment(before, self.joint)[..., None])[..., 0]
        across = moment * np.array([1.0, 1.0, 0.0])
        return {before: small_motion(np.zeros(3), self.compliance_rad_per_nm * across)}


@dataclass(frozen=True)
class SubdivisionError(JointEffect):
    """Interpolation error of the encoder: a sine for every line of its disc."""

    lines: float
    amplitude_urad: float

    def joint_error(self, stance: Stance) -> Vector:
        """Return the sine at the present angle."""
        wave = np.sin(self.lines * stance.q[..., self.joint - 1])
        return self.at_joint(stance, self.amplitude_urad * 1e-6 * wave)


@dataclass(frozen=True)
class FourBar(JointEffect):
    """A parallelogram with unequal rods: error = amplitude x (cos(q + phase) + 0.4 cos 2q).

    q is the angle of the driving joint.
    """

    driven_by: int
    amplitude_mrad: float
    phase_deg: float

    def joint_error(self, stance: Stance) -> Vector:
        """Return what the driving joint's angle does to this one."""
        q = stance.q[..., self.driven_by - 1]
        wave = np.cos(q + math.radians(self.phase_deg)) + 0.4 * np.cos(2.0 * q)
        return self.at_joint(stance, self.amplitude_mrad * 1e-3 * wave)


@dataclass(frozen=True)
class StationSway(Effect):
    """The station sways with the air conditioning: a sine in time."""

    sway_mm: tuple[float, float, float]
    period_s: float

    def base(self, T_tracker_base: Matrix, stance: Stance) -> Matrix:
        """Return the base shifted in the tracker's frame."""
        wave = np.sin(2.0 * math.pi * np.asarray(stance.now.time_s) / self.period_s)
        x, y, z = (v * 1e-3 * wave for v in self.sway_mm)
        return np.asarray(translation(x, y, z) @ T_tracker_base)


@dataclass(frozen=True)
class GripperSag(Effect):
    """The gripper's mount gives way once a payload hangs in it: a shift in the flange frame."""

    shift_mm: tuple[float, float, float]
    full_kg: float

    def tool(self, T_flange_target: Matrix, stance: Stance) -> Matrix:
        """Return the tool shifted in proportion to the root of the payload."""
        share = np.sqrt(np.asarray(stance.now.payload_kg) / self.full_kg)
        x, y, z = (v * 1e-3 * share for v in self.shift_mm)
        return np.asarray(translation(x, y, z) @ T_flange_target)


@dataclass(frozen=True)
class ToolHeat(Effect):
    """The tool's holder bends with temperature: a shift in the flange frame."""

    shift_um_per_k: tuple[float, float, float]
    reference_degc: float = 20.0

    def tool(self, T_flange_target: Matrix, stance: Stance) -> Matrix:
        """Return the tool shifted in proportion to the temperature."""
        warmer = np.asarray(stance.now.temperature_degc - self.reference_degc)
        x, y, z = (v * 1e-6 * warmer for v in self.shift_um_per_k)
        return np.asarray(translation(x, y, z) @ T_flange_target)


@dataclass(frozen=True)
class TargetAcceptance(Effect):
    """The target's centre seems to move along the beam as the target turns away from it."""

    depth_um: float
    """At a target turned across the beam."""

    def seen(self, T_tracker_target: Matrix) -> Vector:
        """Return the shift along the beam: depth x (1 - cos(angle between target and beam))."""
        p = T_tracker_target[..., :3, 3]
        beam = p / np.linalg.norm(p, axis=-1, keepdims=True)
        facing = (beam * T_tracker_target[..., :3, 2]).sum(axis=-1, keepdims=True)
        return np.asarray(self.depth_um * 1e-6 * (1.0 - facing) * beam)
