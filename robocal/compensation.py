"""Joints that bring the calibrated robot to a wanted pose, by Newton's method from nominal ones."""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.identification.problem import rotation_residual
from robocal.kinematics.forward import blocks
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel

_MAX_ITERATIONS = 30
_POSITION_TOLERANCE = 1e-8
"""Far below any instrument and above rounding [m]"""
_ANGLE_TOLERANCE = 1e-8
"""[rad]"""
_LEVER = 0.3
"""Length at which a turn counts as much as a shift, for arms that cannot do both [m]"""


class Reach(StrEnum):
    """Whether a wanted pose was reached."""

    reached = "reached"
    outside_limits = "outside_limits"
    not_reached = "not_reached"


@dataclass(frozen=True)
class Compensation:
    """Joints for every wanted pose."""

    q: Float[Array, "pose joint"]
    """[rad or m]; the last iterate where the pose was not reached."""
    reach: tuple[Reach, ...]
    position_error: Float[Array, "pose"]
    """What the model still misses [m]."""
    angle_error: Float[Array, "pose"]
    """[rad]"""


def joint_jacobian(
    model: KinematicModel, J: Float[Array, "parameter 6 pose"]
) -> Float[Array, "joint 6 pose"]:
    """Derivative with respect to the joint readings: that of theta (revolute) or d (prismatic)."""
    moved = 5 * np.arange(model.n_joints) + np.where(model.prismatic, 1, 0)
    return J[moved]


def compensate(
    model: KinematicModel,
    wanted: Float[Array, "pose 4 4"],
    nominal_q: Float[Array, "pose joint"],
    limits: Float[Array, "joint 2"],
) -> Compensation:
    """Joint readings at which `model` puts its target at the wanted poses.

    Parameters
    ----------
    model
        Calibrated geometry with its frames.
    wanted
        Target poses in the measuring frame.
    nominal_q
        Where to start, which decides the configuration (elbow, wrist) [rad or m].
    limits
        Lower and upper joint readings; a solution outside is named, not clipped.
    """
    q = nominal_q.copy()
    position_error, angle_error = np.empty(len(q)), np.empty(len(q))
    for block in blocks(len(q)):
        q[block], position_error[block], angle_error[block] = _solve(
            model, wanted[block], nominal_q[block]
        )
    inside = np.all((q >= limits[:, 0]) & (q <= limits[:, 1]), axis=1)
    met = (position_error < _POSITION_TOLERANCE * 10) & (angle_error < _ANGLE_TOLERANCE * 10)
    reach = tuple(
        (Reach.reached if within else Reach.outside_limits) if close else Reach.not_reached
        for within, close in zip(inside.tolist(), met.tolist(), strict=True)
    )
    return Compensation(q, reach, position_error, angle_error)


def _solve(
    model: KinematicModel, wanted: Float[Array, "pose 4 4"], q: Float[Array, "pose joint"]
) -> tuple[Float[Array, "pose joint"], Float[Array, "pose"], Float[Array, "pose"]]:
    """Damped Newton steps for all poses of a block together."""
    axes = np.moveaxis(wanted[:, :3, :3], 0, 2)
    position = wanted[:, :3, 3].T
    scale = np.array([1.0, 1.0, 1.0, _LEVER, _LEVER, _LEVER])
    for _ in range(_MAX_ITERATIONS):
        target, J = pose_jacobian(model, q)
        miss = np.concatenate([position - target.p, rotation_residual(axes, target)])
        position_error = np.linalg.norm(miss[:3], axis=0)
        angle_error = np.linalg.norm(miss[3:], axis=0)
        if (position_error < _POSITION_TOLERANCE).all() and (angle_error < _ANGLE_TOLERANCE).all():
            break
        A = np.moveaxis(joint_jacobian(model, J), 2, 0) * scale  # (pose, joint, 6)
        r = (miss.T * scale)[:, :, None]
        normal = A @ np.swapaxes(A, 1, 2)
        normal += 1e-12 * np.trace(normal, axis1=1, axis2=2)[:, None, None] * np.eye(q.shape[1])
        step = np.linalg.solve(normal, A @ r)[:, :, 0]
        largest = np.abs(step).max(axis=1, keepdims=True)
        q = q + step * np.minimum(1.0, 0.3 / np.maximum(largest, 1e-300))
    return q, position_error, angle_error


def without_base(model: KinematicModel) -> KinematicModel:
    """The same robot and tool, seen from its own base."""
    return replace(model, station=np.eye(4), base=np.zeros(6))
