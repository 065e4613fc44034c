"""One robot of the pair with its needle: tips from joints, and which places the needle reaches."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel

_REACHED = 0.1e-3
"""A place is reached when the tip comes this near [m]"""
_ROOM = 0.02
"""Room left to the end of the reach [m]"""
_STEPS = 60
_DAMPING = 0.05
"""Of the joint steps, against singular poses [m/rad]"""
_LEAST = 1e-12
"""Keeps a singular pose's equations solvable [m2/rad2]"""
_STILL = 1e-13
"""Joint step at which the search ends [rad or m]"""
_LONGEST = 0.5
"""Longest joint step [rad or m]"""


@dataclass(frozen=True)
class Arm:
    """A robot that holds a needle.

    Parameters
    ----------
    model
        Nominal or identified geometry; the needle is its tool, the base frame is the identity.
    limits
        Lower and upper joint reading [rad or m].
    sigma_tip
        Standard uncertainty of a tip's place per axis: repeatability and the needle's seat [m].
    sigma_joint
        Standard uncertainty of each joint reading [rad or m], beyond `sigma_tip`.
    link_covariance
        Of an identified model's link parameters, zero for a nominal one [m, rad].
    """

    model: KinematicModel
    limits: Float[Array, "joint 2"]
    sigma_tip: float = 0.05e-3
    sigma_joint: float = 0.0
    link_covariance: Float[Array, "link link"] | None = None

    def needle_poses(self, q: Float[Array, "touch joint"]) -> Float[Array, "touch 4 4"]:
        """Needle frames in the robot's own base."""
        return forward_kinematics(self.model, q)

    def tip_covariance(self, q: Float[Array, "touch joint"]) -> Float[Array, "scalar scalar"]:
        """Covariance of all tips [m2]; the links' uncertainty is common to all touches."""
        _, J = pose_jacobian(self.model, q)
        position = np.moveaxis(J[:, :3], 2, 0)
        n = len(q)
        covariance = np.eye(3 * n) * self.sigma_tip**2
        joints = position[:, self._joint_rows()] * self.sigma_joint
        for touch in range(n):
            rows = slice(3 * touch, 3 * touch + 3)
            covariance[rows, rows] += joints[touch].T @ joints[touch]
        if self.link_covariance is not None:
            links = np.moveaxis(position, 1, 2)[:, :, : len(self.link_covariance)]
            common = links.reshape(3 * n, -1)
            covariance += common @ self.link_covariance @ common.T
        return covariance

    def _joint_rows(self) -> list[int]:
        """Rows of the Jacobian that a joint's own motion moves: theta, or d where it slides."""
        return [5 * j + int(slides) for j, slides in enumerate(self.model.prismatic)]

    def joints_at(
        self, places: Float[Array, "place 3"], start: Float[Array, "place joint"]
    ) -> Float[Array, "place joint"]:
        """Joints that bring the tip as near to each place as the limits allow, from `start` on.

        By damped steps along the Jacobian; the needle's direction is left free. Whether a place was
        reached is for the caller to see.
        """
        q = start
        rows = self._joint_rows()
        for _ in range(_STEPS):
            target, J = pose_jacobian(self.model, q)
            by_joint = np.moveaxis(J[rows, :3], 2, 0)
            away = places - target.p.T
            # The damping fades with the distance left, so that the last steps converge quickly.
            left = np.minimum(1.0, np.linalg.norm(away, axis=1))[:, None, None]
            square = np.einsum("pji,pjk->pik", by_joint, by_joint)
            square += (_DAMPING**2 * left + _LEAST) * np.eye(3)
            force = np.linalg.solve(square, away[:, :, None])[:, :, 0]
            step = np.clip(np.einsum("pji,pi->pj", by_joint, force), -_LONGEST, _LONGEST)
            moved = np.clip(q + step, self.limits[:, 0], self.limits[:, 1])
            if np.abs(moved - q).max(initial=0.0) < _STILL:
                return np.asarray(moved)
            q = moved
        return np.asarray(q)

    def reaches(
        self, places: Float[Array, "place 3"], start: Float[Array, "joint"]
    ) -> Bool[Array, "place"]:
        """Whether the tip comes to each place within the joint limits, searched from `start`.

        With some room: a place counts when those `_ROOM` farther out and farther in are reached
        too. A person sets the stage to millimetres, and does not guide an arm at full stretch.
        """
        outward = places / np.maximum(np.linalg.norm(places, axis=1), _ROOM)[:, None]
        reached = np.ones(len(places), dtype=bool)
        for room in (_ROOM, -_ROOM, 0.0):
            wanted = (places + room * outward)[reached]
            q = self.joints_at(wanted, np.tile(start, (len(wanted), 1)))
            tips = self.needle_poses(q)[:, :3, 3]
            reached[reached] = np.linalg.norm(wanted - tips, axis=1) < _REACHED
        return reached
