r"""Forward kinematics of many poses at once, in structure-of-arrays blocks.

The three axes and the origin of the moving frame are arrays of shape (3, pose); each elementary
transform combines columns. Blocks of `BLOCK` poses stay in the cache (docs/decisions.md, 2).
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.kinematics.model import KinematicModel

BLOCK = 2000
_NO_TURN = np.eye(3)


@dataclass(frozen=True)
class Columns:
    """Axes and origin of a frame for every pose, each (3, pose), or (3, 1) where all agree."""

    x: Float[Array, "3 _"]
    y: Float[Array, "3 _"]
    z: Float[Array, "3 _"]
    p: Float[Array, "3 _"]

    def then(self, T: Float[Array, "4 4"]) -> "Columns":
        """The frame after the constant transform `T`."""
        x, y, z, p = self.x, self.y, self.z, self.p
        if T[:3, 3].any():
            p = p + x * T[0, 3] + y * T[1, 3] + z * T[2, 3]
        if (T[:3, :3] != _NO_TURN).any():
            x, y, z = (x * T[0, k] + y * T[1, k] + z * T[2, k] for k in range(3))
        return Columns(x, y, z, p)


@dataclass(frozen=True)
class JointColumns:
    """What the Jacobian needs of one link: its axes and the two points they pass through."""

    z: Float[Array, "3 _"]
    """Axis of theta, through `before`; direction of d."""
    x: Float[Array, "3 _"]
    """Axis of alpha, through `after`; direction of a."""
    y: Float[Array, "3 _"]
    """Axis of beta, through `after`."""
    before: Float[Array, "3 _"]
    after: Float[Array, "3 _"]


def columns_of(T: Float[Array, "4 4"]) -> Columns:
    """One constant frame as columns."""
    return Columns(T[:3, 0:1], T[:3, 1:2], T[:3, 2:3], T[:3, 3:4])


def walk(
    model: KinematicModel, q: Float[Array, "pose joint"]
) -> tuple[Columns, list[JointColumns]]:
    """Frame of the last link for every pose, and the columns of every joint on the way.

    Raises
    ------
    ValueError
        If `q` does not have `model.n_joints` columns.
    """
    if q.ndim != 2 or q.shape[1] != model.n_joints:
        raise ValueError(f"q has shape {q.shape}, the robot has {model.n_joints} joints")
    frame = columns_of(model.base_frame @ model.mount)
    return chain(frame, model.links, model.prismatic, q.T)


def chain(
    frame: Columns,
    links: Float[Array, "joint 5"] | Float[Array, "joint 5 _"],
    prismatic: Bool[Array, "joint"],
    readings: Float[Array, "joint _"] | Float[Array, "joint"],
) -> tuple[Columns, list[JointColumns]]:
    """Frame after all links, from `frame` on.

    Either the readings differ from column to column (one robot, many poses) or the links do (many
    draws of a robot, one pose).
    """
    x, y, z, p = frame.x, frame.y, frame.z, frame.p
    joints = []
    for (theta, d, a, alpha, beta), slides, reading in zip(links, prismatic, readings, strict=True):
        before, z_joint = p, z
        turn, slide = (theta, d + reading) if slides else (theta + reading, d)
        c, s = np.cos(turn), np.sin(turn)
        x, y = x * c + y * s, y * c - x * s
        if not _is_zero(slide):
            p = p + z * slide
        if not _is_zero(a):
            p = p + x * a
        x_joint = x
        if not _is_zero(alpha):
            ca, sa = np.cos(alpha), np.sin(alpha)
            y, z = y * ca + z * sa, z * ca - y * sa
        y_joint = y
        if not _is_zero(beta):
            cb, sb = np.cos(beta), np.sin(beta)
            x, z = x * cb - z * sb, z * cb + x * sb
        joints.append(JointColumns(z_joint, x_joint, y_joint, before, p))
    return Columns(x, y, z, p), joints


def _is_zero(value: object) -> bool:
    """True for the plain number zero; arrays are never skipped."""
    return isinstance(value, float) and not value


def blocks(n_poses: int, size: int = BLOCK) -> Iterator[slice]:
    """Slices that cover `n_poses` rows, `size` at a time."""
    return (slice(first, min(first + size, n_poses)) for first in range(0, n_poses, size))


def forward_kinematics(
    model: KinematicModel, q: Float[Array, "pose joint"]
) -> Float[Array, "pose 4 4"]:
    r"""Pose of the target in the measuring frame, one per row of joint readings.

    Parameters
    ----------
    model
        Robot with its base and tool frames.
    q
        Joint readings as the controller reports them [rad], [m] for prismatic joints. Never wrapped
        to (-pi, pi]: gear effects depend on the number of turns.

    Returns
    -------
    T_station_target
        Homogeneous transforms, translation in [m].

    Raises
    ------
    ValueError
        If `q` does not have `model.n_joints` columns.

    References
    ----------
    .. [1] CN117067221B, eq. (1)-(3); conventions in docs/physics.md.

    Examples
    --------
    >>> links = np.array([[0.0, 0.0, 0.5, 0.0, 0.0]])
    >>> arm = KinematicModel(links=links, prismatic=np.array([False]))
    >>> forward_kinematics(arm, np.array([[np.pi / 2]]))[0, :3, 3].round(6)
    array([0. , 0.5, 0. ])
    """
    T = np.empty((len(q), 4, 4))
    T[:, 3] = (0.0, 0.0, 0.0, 1.0)
    for block in blocks(len(q)):
        last, _ = walk(model, q[block])
        target = last.then(model.tool_frame)
        for column, values in enumerate((target.x, target.y, target.z, target.p)):
            T[block, :3, column] = values.T
    return T


def pose_blocks(
    model: KinematicModel, readings: Iterable[Float[Array, "_ joint"]]
) -> Iterator[Float[Array, "_ 4 4"]]:
    """Poses of any number of joint readings in bounded memory.

    Parameters
    ----------
    model
        Robot with its base and tool frames.
    readings
        Joint readings in pieces of any size [rad or m], drawn or read as they are asked for.

    Yields
    ------
    T_station_target
        Poses in the order of the readings, at most `BLOCK` at a time.
    """
    for piece in readings:
        for block in blocks(len(piece)):
            yield forward_kinematics(model, piece[block])
