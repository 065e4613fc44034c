"""Hidden effects of gravity: joints, links and base yield to what the arm carries."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivers.emulators.effect import Effect, JointEffect
from drivers.emulators.rigid import Matrix, small_motion
from drivers.emulators.stance import Stance
from drivers.emulators.true_arm import Vector


def hardened(load: Vector, hardening_nm: float) -> Vector:
    """Load as a spring feels it that grows stiffer: h tanh(load / h)."""
    if math.isinf(hardening_nm):
        return load
    return np.asarray(hardening_nm * np.tanh(load / hardening_nm))


@dataclass(frozen=True)
class JointCompliance(JointEffect):
    """The joint yields to gravity: error = compliance x gravity load of links and payload."""

    compliance_rad_per_nm: float
    """[rad/(N m)], [m/N] for a prismatic joint."""
    hardening_nm: float = math.inf
    """Load at which the spring has clearly hardened [N m]."""

    def joint_error(self, stance: Stance) -> Vector:
        """Return compliance times the load about the joint's axis."""
        load = hardened(stance.loads[..., self.joint - 1], self.hardening_nm)
        return self.at_joint(stance, self.compliance_rad_per_nm * load)


@dataclass(frozen=True)
class PayloadCompliance(JointEffect):
    """The joint yields to the payload alone: the controller already corrects for the links."""

    compliance_rad_per_nm: float
    hardening_nm: float = math.inf

    def joint_error(self, stance: Stance) -> Vector:
        """Return compliance times the payload's load about the joint's axis."""
        load = hardened(stance.payload_loads[..., self.joint - 1], self.hardening_nm)
        return self.at_joint(stance, self.compliance_rad_per_nm * load)


@dataclass(frozen=True)
class LoadBacklash(JointEffect):
    """Play that the load presses to one side: error = (width / 2) x sign of the gravity load."""

    width_mrad: float
    smooth_nm: float = 0.0
    """Load over which the sign changes: tanh(load / smooth_nm) instead of the sign [N m]."""

    def joint_error(self, stance: Stance) -> Vector:
        """Return half the width towards the load."""
        load = stance.loads[..., self.joint - 1]
        side = np.tanh(load / self.smooth_nm) if self.smooth_nm > 0.0 else np.sign(load)
        return self.at_joint(stance, 0.5e-3 * self.width_mrad * side)


@dataclass(frozen=True)
class LinkBending(JointEffect):
    """The link behind the joint is a cantilever that bends under the weight at its tip.

    With e the link's direction, L its length, F and M force and moment at its tip, both across e:
    turn = (L M + L^2/2 e x F) / EI, shift = (L^2/2 M x e + L^3/3 F) / EI (Euler and Bernoulli).
    """

    compliance_rad_per_nm: float
    """L / EI."""
    flat_share: float = 1.0
    """Compliance across the link's y over that across its z, for a section that is not round."""

    def flexures(self, stance: Stance) -> Mapping[int, Matrix]:
        """Return turn and shift of the link's tip, in the tip's frame."""
        tip = stance.frames[self.joint]
        e, length = self._direction(stance)
        back = np.swapaxes(tip[..., :3, :3], -1, -2)

        def local(vector: Vector) -> Vector:
            inside = (back @ vector[..., None])[..., 0]
            along = (back @ e[..., None])[..., 0]
            return np.asarray(inside - along * (along * inside).sum(axis=-1, keepdims=True))

        e_tip = (back @ e[..., None])[..., 0]
        F = local(stance.weight(self.joint + 1))
        M = local(stance.moment(self.joint, self.joint + 1))
        turn = M + 0.5 * length * np.cross(e_tip, F)
        shift = 0.5 * length * np.cross(M, e_tip) + length**2 / 3.0 * F
        uneven = np.array([1.0, self.flat_share, 1.0])
        c = self.compliance_rad_per_nm
        return {self.joint: small_motion(c * shift * uneven[[0, 2, 1]], c * turn * uneven)}

    def _direction(self, stance: Stance) -> tuple[Vector, Vector]:
        span = stance.frames[self.joint][..., :3, 3] - stance.frames[self.joint - 1][..., :3, 3]
        length = np.linalg.norm(span, axis=-1, keepdims=True)
        return span / length, length


@dataclass(frozen=True)
class BaseCompliance(Effect):
    """Pedestal or base plate tilts: turn = compliance x overturning moment about its origin."""

    compliance_rad_per_nm: float
    y_share: float = 1.0
    """Compliance about the base's y over that about its x."""

    def base(self, T_tracker_base: Matrix, stance: Stance) -> Matrix:
        """Return the base tilted about its own x and y."""
        share = np.array([1.0, self.y_share, 0.0])
        tilt = self.compliance_rad_per_nm * stance.moment(0, 0) * share
        return np.asarray(T_tracker_base @ small_motion(np.zeros(3), tilt))
