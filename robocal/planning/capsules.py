"""The arm as capsules along its link lines, and how near they come to each other.

Joint i runs along its axis by d and then along the common normal by a; those two lines, and the one
from the last link to the target, stand for the arm. Lines without length are left out.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.kinematics.forward import walk
from robocal.kinematics.model import KinematicModel

_POINT = 1e-6
"""Lines shorter than this are joints without a body [m]"""

Line = Float[Array, "3 pose"]


@dataclass(frozen=True)
class Segment:
    """One capsule's axis at every pose."""

    start: Line
    end: Line

    @property
    def length(self) -> float:
        """Longest over the poses [m]."""
        return float(np.linalg.norm(self.end - self.start, axis=0).max(initial=0.0))


@dataclass(frozen=True)
class ArmShape:
    """The arm at every pose."""

    segments: tuple[Segment, ...]
    """From the pedestal to the target."""
    joint: tuple[int, ...]
    """Joint that each segment hangs on, counted from 0; the pedestal's is -1."""
    target: Line
    axes: Float[Array, "3 3 pose"]
    """Component, axis of the target frame, pose."""


def arm_shape(model: KinematicModel, q: Float[Array, "pose joint"], floor: float) -> ArmShape:
    """Lines of the arm and its target; the pedestal goes from `floor` up to the base origin."""
    n = len(q)
    last, joints = walk(model, q)
    tip = last.then(model.tool_frame)
    base = (model.base_frame @ model.mount)[:3, 3:4]
    foot = np.array([[base[0, 0]], [base[1, 0]], [min(floor, base[2, 0])]])
    lines = [(-1, foot, base)]
    for number, joint in enumerate(joints):
        slide = model.links[number, 1] + (q[:, number] if model.prismatic[number] else 0.0)
        corner = joint.before + joint.z * slide
        lines += [(number, joint.before, corner), (number, corner, joint.after)]
    lines.append((model.n_joints, last.p, tip.p))
    shaped = [(number, Segment(_wide(a, n), _wide(b, n))) for number, a, b in lines]
    kept = [(i, line) for i, line in shaped if i == -1 or line.length > _POINT]
    axes = np.stack([_wide(axis, n) for axis in (tip.x, tip.y, tip.z)], axis=1)
    return ArmShape(
        tuple(line for _, line in kept), tuple(i for i, _ in kept), _wide(tip.p, n), axes
    )


def _wide(columns: Float[Array, "3 _"], n: int) -> Line:
    return np.ascontiguousarray(np.broadcast_to(columns, (3, n)))


def self_clearance(shape: ArmShape, radius: float) -> Float[Array, "pose"]:
    """Least gap between two capsules that are apart along the arm, negative where they overlap [m].

    Capsules with less than two diameters of arm between them always are near each other; what
    keeps those apart are the joint limits. Infinite for an arm without others.
    """
    n_poses = shape.target.shape[1]
    lengths = [segment.length for segment in shape.segments]
    pairs = [
        (earlier, later)
        for later in range(2, len(lengths))
        for earlier in range(later - 1)
        if sum(lengths[earlier + 1 : later]) >= 4.0 * radius
    ]
    if not pairs:
        return np.full(n_poses, np.inf)
    # All pairs side by side: for the few poses of a path the calls cost more than the sums.
    one, other = (
        Segment(
            np.concatenate([shape.segments[i].start for i in side], axis=1),
            np.concatenate([shape.segments[i].end for i in side], axis=1),
        )
        for side in zip(*pairs, strict=True)
    )
    return np.asarray(distance(one, other).reshape(-1, n_poses).min(axis=0) - 2.0 * radius)


def is_hidden(
    shape: ArmShape, radius: float, eye: tuple[float, float, float]
) -> Bool[Array, "pose"]:
    """Poses at which a link stands between the point `eye` and the target."""
    hidden = np.zeros(shape.target.shape[1], dtype=bool)
    start = _wide(np.array(eye)[:, None], len(hidden))
    sight = Segment(start, shape.target)
    # What carries the target within a diameter of it is the nest's own side: acceptance judges it.
    left = 0.0
    for segment in reversed(shape.segments):
        if left > 2.0 * radius:
            hidden |= distance(segment, sight) < radius
        left += segment.length
    return hidden


def distance(one: Segment, other: Segment) -> Float[Array, "pose"]:
    """Shortest distance between two segments at every pose [m].

    References
    ----------
    .. [1] C. Ericson, *Real-Time Collision Detection*, Morgan Kaufmann, 2005, section 5.1.9.
    """
    d1, d2 = one.end - one.start, other.end - other.start
    r = one.start - other.start
    a, e = (d1 * d1).sum(axis=0), (d2 * d2).sum(axis=0)
    b, c, f = (d1 * d2).sum(axis=0), (d1 * r).sum(axis=0), (d2 * r).sum(axis=0)
    a_safe, e_safe = np.maximum(a, 1e-18), np.maximum(e, 1e-18)
    across = a * e - b * b
    s = np.where(across > 1e-12 * a_safe * e_safe, b * f - c * e, 0.0)
    s = np.clip(s / np.maximum(across, 1e-30), 0.0, 1.0)
    t = np.clip((b * s + f) / e_safe, 0.0, 1.0)
    s = np.clip((b * t - c) / a_safe, 0.0, 1.0)
    return np.asarray(np.linalg.norm(r + d1 * s - d2 * t, axis=0))
