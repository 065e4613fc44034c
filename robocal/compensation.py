"""Joints that bring the calibrated robot to a wanted pose, by least squares from the nominal ones.

An arm with six joints or more meets the whole pose; one with fewer meets the position, and the
orientation as well as it can. Where the user gives no nominal joints, the nominal robot's are
found from a spread of starts, all targets in one configuration if the arm allows it.
"""

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.identification.problem import rotation_residual
from robocal.kinematics.forward import Columns, blocks, forward_kinematics, walk
from robocal.kinematics.model import KinematicModel

_MAX_ITERATIONS = 30
_SEARCH_ITERATIONS = 12
"""From a far start: what has not come close by then starts again elsewhere."""
_POSITION_TOLERANCE = 1e-8
"""Far below any instrument and above rounding [m]"""
_ANGLE_TOLERANCE = 1e-8
"""[rad]"""
_STANDSTILL = 1e-9
"""Error or step at which the iteration ends [m, rad]"""
_LEAST_DAMPING = 1e-12
"""Of the mean curvature: enough to solve a singular system"""
_LEVER = 0.3
"""Length at which a turn counts as much as a shift [m]"""
_WEAK_LEVER = 1e-3
"""The same for an arm that cannot choose its whole orientation: position goes first [m]"""
_LARGEST_STEP = 0.3
"""Of any joint in one iteration, so that a start keeps its configuration [rad or m]"""
_SINGULAR = 1e-3
"""Smallest singular value of the Jacobian, turns counted at `_LEVER`, at which a pose counts as
singular: a joint turns by 1 mrad for each micrometre of the pose [m/rad]"""
_NEAR = 5e-3
"""Error at the end of a failed iteration up to which the singular pose where it ended is to blame,
not the arm's length; the size of a geometry error [m, rad]"""
_STARTS = 20_000
_ROUNDS = 10
"""Starts that are tried for one target."""
_SAMPLE = 200
"""Targets that decide which configuration is used for all."""
_ELBOWS = {4: (0, 1, 2), 6: (1, 2, 4), 7: (1, 3, 5)}
"""By number of joints: shoulder, elbow and wrist joint, whose line is straight at an elbow
singularity"""
_WRISTS = {6: ((3, 4, 5),), 7: ((0, 1, 2), (4, 5, 6))}
"""Three joints each, whose axes lie in one plane at a wrist or shoulder singularity"""


class Reach(StrEnum):
    """Whether a wanted pose was reached."""

    reached = "reached"
    outside_limits = "outside_limits"
    singular = "singular"
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


def compensate_targets(
    calibrated: CalibratedRobot,
    wanted: Float[Array, "pose 4 4"],
    nominal_q: Float[Array, "pose joint"] | None,
    *,
    in_base: bool,
) -> Compensation:
    """Joints for tool poses, in the measuring frame or in the robot base.

    Parameters
    ----------
    wanted
        Target poses.
    nominal_q
        Joints that the nominal robot would use, which decide the configuration [rad or m]. None:
        they are found, in one configuration for all where the arm allows it.
    in_base
        True where `wanted` stands in the robot base instead of the measuring frame.
    """
    model = calibrated.model
    nominal = replace(calibrated.robot.geometry, station=model.base_frame, flange=model.tool_frame)
    if in_base:
        model, nominal = without_base(model), without_base(nominal)
    limits = calibrated.robot.limits
    if nominal_q is None:
        nominal_q = find_nominal_joints(nominal, wanted, limits)
    return compensate(model, wanted, nominal_q, limits)


def without_base(model: KinematicModel) -> KinematicModel:
    """The same robot and tool, seen from its own base."""
    return replace(model, station=np.eye(4), base=np.zeros(6))


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
    solution = _solve(model, wanted, nominal_q, _MAX_ITERATIONS)
    kept = _configurations(model, nominal_q) == _configurations(model, solution.q)
    near = np.maximum(solution.position_error, solution.angle_error) < _NEAR
    dexterity = np.minimum(_dexterity(model, nominal_q), _dexterity(model, solution.q))
    singular = near & ((dexterity < _SINGULAR) | ~solution.met)
    # numpy.full would turn the members into plain text.
    reach = np.empty(len(wanted), dtype=object)
    reach[:] = Reach.reached
    reach[~_inside(solution.q, limits)] = Reach.outside_limits
    reach[~solution.met | ~kept] = Reach.not_reached
    reach[singular] = Reach.singular
    return Compensation(
        solution.q, tuple(reach.tolist()), solution.position_error, solution.angle_error
    )


def _inside(q: Float[Array, "pose joint"], limits: Float[Array, "joint 2"]) -> Bool[Array, "pose"]:
    return np.asarray(((q >= limits[:, 0]) & (q <= limits[:, 1])).all(axis=1))


@dataclass(frozen=True)
class _Solution:
    """Where the iteration ended."""

    q: Float[Array, "pose joint"]
    met: Bool[Array, "pose"]
    position_error: Float[Array, "pose"]
    angle_error: Float[Array, "pose"]


def _solve(
    model: KinematicModel,
    wanted: Float[Array, "pose 4 4"],
    start: Float[Array, "pose joint"],
    iterations: int,
) -> _Solution:
    """Least squares for every pose from its own start, without regard to limits."""
    q = start.copy()
    errors = np.full((2, len(q)), np.inf)
    for block in blocks(len(q)):
        _solve_block(model, wanted[block], q[block], errors[:, block], iterations)
    position_error, angle_error = errors
    met = position_error < _POSITION_TOLERANCE
    if model.n_joints >= 6:
        met &= angle_error < _ANGLE_TOLERANCE
    return _Solution(q, met, position_error, angle_error)


def _solve_block(
    model: KinematicModel,
    wanted: Float[Array, "pose 4 4"],
    q: Float[Array, "pose joint"],
    errors: Float[Array, "2 pose"],
    iterations: int,
) -> None:
    """Levenberg-Marquardt steps, in place; a step that makes a pose worse is taken back."""
    whole = model.n_joints >= 6
    scale = np.repeat([1.0, _LEVER if whole else _WEAK_LEVER], 3)
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
            far &= (errors[:, active] > _STANDSTILL).any(axis=0)
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


def _configurations(model: KinematicModel, q: Float[Array, "pose joint"]) -> Int[Array, "pose"]:
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


def _dexterity(model: KinematicModel, q: Float[Array, "pose joint"]) -> Float[Array, "pose"]:
    """Smallest singular value of the Jacobian, turns counted at `_LEVER` [m/rad]."""
    smallest = np.empty(len(q))
    scale = np.repeat([1.0, _LEVER], 3)[:, None]
    for block in blocks(len(q)):
        _, J = _joint_jacobian(model, q[block])
        smallest[block] = np.linalg.svd(J * scale, compute_uv=False)[:, -1]
    return smallest


def find_nominal_joints(
    nominal: KinematicModel, wanted: Float[Array, "pose 4 4"], limits: Float[Array, "joint 2"]
) -> Float[Array, "pose joint"]:
    """Joints of the nominal robot at the wanted poses, from a spread of starts.

    The configuration in which most of a sample of targets can be reached is used for all; a target
    that it does not reach takes another one. Full turns are those nearest to the target before.
    Where no start leads to the target, the joints of the nearest start are returned.
    """
    middle = limits.mean(axis=1)
    half = np.diff(limits, axis=1)[:, 0] / 2
    half = np.where(nominal.prismatic, half, np.minimum(half, np.pi))
    spread = middle + np.random.default_rng(1).uniform(-half, half, (_STARTS, len(half)))
    kinds = _configurations(nominal, spread)
    sample = np.linspace(0, len(wanted) - 1, min(len(wanted), _SAMPLE)).astype(int)
    q, found = _search(nominal, wanted[sample], limits, spread)
    reached = _configurations(nominal, q[found])
    common = int(np.bincount(reached).argmax()) if len(reached) else 0
    q, found = _search(nominal, wanted, limits, spread[kinds == common])
    rest = np.flatnonzero(~found)
    if len(rest):
        q[rest], _ = _search(nominal, wanted[rest], limits, spread)
    return _near_turns(q, limits, nominal)


def _search(
    nominal: KinematicModel,
    wanted: Float[Array, "pose 4 4"],
    limits: Float[Array, "joint 2"],
    spread: Float[Array, "start joint"],
) -> tuple[Float[Array, "pose joint"], Bool[Array, "pose"]]:
    """Joints within limits from the starts whose poses are nearest, one after the other.

    Only solutions in the configuration of their start count.
    """
    from scipy.spatial import KDTree

    tree = KDTree(_pose_features(forward_kinematics(nominal, spread)))
    order = np.asarray(tree.query(_pose_features(wanted), k=_ROUNDS)[1])
    q = spread[order[:, 0]]
    rows = np.arange(len(wanted))
    middle = limits.mean(axis=1)
    for nearest in order.T:
        start = spread[nearest[rows]]
        solution = _solve(nominal, wanted[rows], start, _SEARCH_ITERATIONS)
        turned = np.remainder(solution.q - middle + np.pi, 2 * np.pi) + middle - np.pi
        turned = np.where(nominal.prismatic, solution.q, turned)
        kept = _configurations(nominal, start) == _configurations(nominal, turned)
        done = solution.met & kept & _inside(turned, limits)
        q[rows[done]] = turned[done]
        rows = rows[~done]
        if not len(rows):
            break
    found = np.ones(len(wanted), dtype=bool)
    found[rows] = False
    return q, found


def _pose_features(T: Float[Array, "pose 4 4"]) -> Float[Array, "pose 12"]:
    """Coordinates in which near poses are near: position, and axes at the lever."""
    return np.concatenate([T[:, :3, 3], _LEVER * T[:, :3, :3].reshape(-1, 9)], axis=1)


def _near_turns(
    q: Float[Array, "pose joint"], limits: Float[Array, "joint 2"], model: KinematicModel
) -> Float[Array, "pose joint"]:
    """The same poses with every full turn as near to the row before as the limits allow."""
    turn = 2 * np.pi
    wide = ~model.prismatic & (np.diff(limits, axis=1)[:, 0] > turn)
    for joint in np.flatnonzero(wide):
        low, high = limits[joint].tolist()
        previous, readings = (low + high) / 2, q[:, joint].tolist()
        for row, reading in enumerate(readings):
            near = reading + turn * round((previous - reading) / turn)
            previous = near + turn * ((near < low) - (near > high))
            readings[row] = previous
        q[:, joint] = readings
    return q
