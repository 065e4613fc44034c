"""From which side each joint comes into a pose.

A joint that always comes from one side hides its backlash in the geometry. So every joint comes
from below into half of the poses and from above into the other half, drawn by the campaign's seed,
and for a calibration the sides change with every repeat. A verification keeps its sides: ISO 9283
asks for one approach to each pose. A follow-up comes from the sides that its diagnosis asks for.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.robots.robot import Robot


@dataclass(frozen=True)
class Sides:
    """Directions of approach of a campaign."""

    signs: Int[Array, "pose joint"]
    """1 where the joint rises into the pose, -1 where it falls."""
    offset: Float[Array, "joint"]
    """How far before the pose each joint begins its last move [rad or m]."""
    limits: Float[Array, "joint 2"]
    poses_alike: int
    """So many poses in a row come from the same sides."""
    change_with_repeats: bool

    @property
    def stated(self) -> bool:
        """Whether there is an approach of its own at all."""
        return bool((self.offset > 0).any())

    def of(self, idx: int, repeat: int, commanded: Float[Array, "joint"]) -> Int[Array, "joint"]:
        """Sides of one visit; the other one for a joint that has no room on its own."""
        signs = self.signs[idx // self.poses_alike]
        if self.change_with_repeats and repeat % 2:
            signs = -signs
        before = commanded - signs * self.offset
        low, high = self.limits.T
        return np.asarray(np.where((before < low) | (before > high), -signs, signs))

    def before(
        self, commanded: Float[Array, "joint"], signs: Int[Array, "joint"]
    ) -> Float[Array, "joint"]:
        """Where the last move into a pose begins."""
        return np.asarray(commanded - signs * self.offset)


def balanced_sides(n_poses: int, n_joints: int, seed: int) -> Int[Array, "pose joint"]:
    """Signs, drawn at random, each joint's in balance."""
    column = np.where(np.arange(n_poses) % 2, 1, -1)
    rng = np.random.default_rng(seed)
    return np.stack([rng.permutation(column) for _ in range(n_joints)], axis=1)


def as_asked(
    signs: Int[Array, "pose joint"], asked: Sequence[list[int] | None]
) -> Int[Array, "pose joint"]:
    """Signs with those that are asked for in their place; 0 or None asks for none."""
    signs = signs.copy()
    for own, wanted in zip(signs, asked, strict=True):
        if wanted is not None:
            own[:] = np.where(wanted, wanted, own)
    return signs


def approach_offset(robot: Robot, turn: float, slide: float) -> Float[Array, "joint"]:
    """The offset of every joint: `turn` [rad], `slide` [m] of a prismatic one."""
    return np.where(robot.geometry.prismatic, slide, turn)
