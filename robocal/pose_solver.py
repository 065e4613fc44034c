"""Joints that bring a model to wanted poses: damped least squares, every pose from its own start.

An arm with six joints or more meets the whole pose; one with fewer meets the position, and the
orientation as well as it can.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.identification.problem import rotation_residual
from robocal.kinematics.forward import Columns, blocks, walk
from robocal.kinematics.model import KinematicModel

MAX_ITERATIONS = 30
_POSITION_TOLERANCE = 1e-8
"""Far below any instrument and above rounding [m]"""
_ANGLE_TOLERANCE = 1e-8
"""[rad]"""
_STANDSTILL = 1e-9
"""Error or step at which the iteration ends [m, rad]"""
_ROUGH = 1e-5
"""Error at which the configuration is known and the rest left to another iteration [m, rad]"""
_LEAST_DAMPING = 1e-12
"""Of the mean curvature: enough to solve a singular system"""
LEVER = 0.3
"""Length at which a turn counts as much as a shift [m]"""
_WEAK_LEVER = 1e-3
"""The same for an arm that cannot choose its whole orientation: position goes first [m]"""
_LARGEST_STEP = 0.3
"""Of any joint in one iteration, so that a start keeps its configuration [rad or m]"""
_ELBOWS = {4: (0, 1, 2), 6: (1, 2, 4), 7: (1, 3, 5)}
"""By number of joints: shoulder, elbow and wrist joint, whose line is straight at an elbow
singularity"""
_WRISTS = {6: ((3, 4, 5),), 7: ((0, 1, 2), (4, 5, 6))}
"""Three joints each, whose axes lie in one plane at a wrist or shoulder singularity"""


@dataclass(frozen=True)
class Solution:
    """Where the iteration ended."""

    q: Float[Array, "pose joint"]
    met: Bool[Array, "pose"]
    position_error: Float[Array, "pose"]
    angle_error: Float[Array, "pose"]


def solve_joints(
    model: KinematicModel,
    wanted: Float[Array, "pose 4 4"],
    start: Float[Array, "pose joint"],
    iterations: int = MAX_ITERATIONS,
    *,
    roughly: bool = False,
) -> Solution:
    """Least squares for every pose from its own start, without regard to limits.

    `roughly` ends at, and counts as met within, an error that shows the configuration.
    """
    enough = _ROUGH if roughly else _STANDSTILL
    q = start.copy()
    errors = np.full((2, len(q)), np.inf)
    for block in blocks(len(q)):
        _solve_block(model, wanted[block], q[block], errors[:, block], iterations, enough)
    met = met_within(errors[0], errors[1], model.n_joints, _ROUGH if roughly else None)
    return Solution(q, met, errors[0], errors[1])


def met_within(
    position_error: Float[Array, "pose"],
    angle_error: Float[Array, "pose"],
    n_joints: int,
    tolerance: float | None = None,
) -> Bool[Array, "pose"]:
    """Whether poses count as met; an arm with fewer than six joints need not meet the angle."""
    met = position_error < (tolerance or _POSITION_TOLERANCE)
    angle_met = angle_error < (tolerance or _ANGLE_TOLERANCE)
    return np.asarray(met & angle_met if n_joints >= 6 else met)


def inside_limits(
    q: Float[Array, "pose joint"], limits: Float[Array, "joint 2"]
) -> Bool[Array, "pose"]:
    """Whether all joints of a pose lie within their limits."""
    return np.asarray(((q >= limits[:, 0]) & (q <= limits[:, 1])).all(axis=1))


def turned_inside(
    q: Float[Array, "pose joint"], limits: Float[Array, "joint 2"], model: KinematicModel
) -> Float[Array, "pose joint"]:
    """The same poses, with the fewest full turns that bring a joint inside its limits.

    A joint that no number of turns brings inside stays where it is.
    """
    turn = 2 * np.pi
    low, high = limits.T
    short = np.ceil((low - q) / turn) * turn
    long = np.floor((high - q) / turn) * turn
    turned = np.where(q < low, q + short, np.where(q > high, q + long, q))
    helps = ~model.prismatic & (turned >= low) & (turned <= high)
    return np.asarray(np.where(helps, turned, q))


def _solve_block(
    model: KinematicModel,
    wanted: Float[Array, "pose 4 4"],
    q: Float[Array, "pose joint"],
    errors: Float[Array, "2 pose"],
    iterations: int,
    enough: float,
) -> None:
    """Levenberg-Marquardt steps, in place; a step that makes a pose worse is taken back."""
    whole = model.n_joints >= 6
    scale = np.repeat([1.0, LEVER if whole else _WEAK_LEVER], 3)
    active: Int[Array, "active"] = np.arange(len(q))
    trial, damping = q.copy(), np.full(len(q), _LEAST_DAMPING)
    J, miss = np.empty((len(q), 6, model.n_joints)), np.full((len(q), 6), np.inf)
    for _ in range(iterations):
        target, J_trial = _joint_jacobian(model, trial)
        axes = np.moveaxis(wanted[active, :3, :3], 0, 2)
        shift, turn = wanted[active, :3, 3].T - target.p, rotation_residual(axes, target)
        miss_trial = np.concatenate([shift, turn]).T * scale
        better = (miss_trial**2).sum(axis=1) < (miss[active] ** 2).sum(axis=1)
        improved = active[better]
        q[improved], J[improved] = trial[better], J_trial[better] * scale[:, None]
        miss[improved] = miss_trial[better]
        errors[0, improved] = np.linalg.norm(shift[:, better], axis=0)
        errors[1, improved] = np.linalg.norm(turn[:, better], axis=0)
        damping[active] = np.where(
            better, np.maximum(damping[active] / 30, _LEAST_DAMPING), damping[active] * 1000
        )
        step = _step(J[active], miss[active], damping[active])
        far = np.abs(step).max(axis=1) > _STANDSTILL
        if whole:
            far &= (errors[:, active] > enough).any(axis=0)
        active, trial = active[far], q[active[far]] + step[far]
        if not len(active):
            break


def _step(
    J: Float[Array, "pose 6 joint"], miss: Float[Array, "pose 6"], damping: Float[Array, "pose"]
) -> Float[Array, "pose joint"]:
    """Least-squares step, no joint beyond `_LARGEST_STEP`."""
    J_T = np.swapaxes(J, 1, 2)
    normal = J_T @ J
    damping = damping * np.trace(normal, axis1=1, axis2=2)
    normal += damping[:, None, None] * np.eye(J.shape[2])
    step = np.linalg.solve(normal, J_T @ miss[:, :, None])[:, :, 0]
    largest = np.abs(step).max(axis=1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, _LARGEST_STEP / np.maximum(largest, 1e-300)))


def _joint_jacobian(
    model: KinematicModel, q: Float[Array, "pose joint"]
) -> tuple[Columns, Float[Array, "pose 6 joint"]]:
    """Target frames and their derivative with respect to the joint readings.

    Rows 0 to 2 are position, rows 3 to 5 rotation vector, in the measuring frame.
    """
    last, joints = walk(model, q)
    target = last.then(model.tool_frame)
    J = np.zeros((6, model.n_joints, len(q)))
    for number, (joint, slides) in enumerate(zip(joints, model.prismatic, strict=True)):
        if slides:
            J[:3, number] = joint.z
        else:
            J[:3, number] = _cross(joint.z, target.p - joint.before)
            J[3:, number] = joint.z
    return target, np.ascontiguousarray(J.transpose(2, 0, 1))


def _cross(u: Float[Array, "3 _"], v: Float[Array, "3 _"]) -> Float[Array, "3 _"]:
    return np.stack([
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ])


def configurations(model: KinematicModel, q: Float[Array, "pose joint"]) -> Int[Array, "pose"]:
    """Shoulder, elbow and wrist as one number: signs that change only where the arm is singular."""
    configuration = np.zeros(len(q), dtype=int)
    for block in blocks(len(q)):
        signs = []
        _, joints = walk(model, q[block])
        if model.n_joints == 6:
            signs.append(np.linalg.det(_joint_jacobian(model, q[block])[1]))
        if model.n_joints in _ELBOWS:
            shoulder, elbow, wrist = (joints[number] for number in _ELBOWS[model.n_joints])
            upper_arm, forearm = elbow.before - shoulder.before, wrist.before - elbow.before
            signs.append((elbow.z * _cross(upper_arm, forearm)).sum(axis=0))
        for first, second, third in _WRISTS.get(model.n_joints, ()):
            plane = _cross(joints[second].z, joints[third].z)
            signs.append((joints[first].z * plane).sum(axis=0))
        for bit, sign in enumerate(signs):
            configuration[block] += (sign > 0).astype(int) << bit
    return configuration


def dexterities(model: KinematicModel, q: Float[Array, "pose joint"]) -> Float[Array, "pose"]:
    """Smallest singular value of the Jacobian, turns counted at `LEVER` [m/rad]."""
    smallest = np.empty(len(q))
    scale = np.repeat([1.0, LEVER], 3)[:, None]
    for block in blocks(len(q)):
        _, J = _joint_jacobian(model, q[block])
        smallest[block] = np.linalg.svd(J * scale, compute_uv=False)[:, -1]
    return smallest
