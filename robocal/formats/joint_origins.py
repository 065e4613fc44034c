"""An arm as a chain of fixed origins with a motion along or about z after each: URDF, UR YAML."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.formats.euler import angles_from_rotation, rotation_from_angles
from robocal.kinematics.model import KinematicModel
from robocal.robots.from_axes import links_from_frames

_RIGHT_ANGLE = np.pi / 2 + 1e-9
_AXIAL = 1e-12
"""Largest part of a frame across z that counts as rounding [1, m]"""


@dataclass(frozen=True)
class JointOrigins:
    """Frame of every joint in the one before it, and what follows the last joint."""

    origins: Float[Array, "joint 4 4"]
    """The first in the robot base, joints at zero"""
    end: Float[Array, "4 4"]
    """Flange in the frame of the last joint"""


def origins_of(model: KinematicModel) -> JointOrigins:
    """The links of `model`, with its mount but without base and tool.

    A joint's motion commutes with its own Rz(theta) Tz(d), so the origin of joint i + 1 is
    Tx(a) Rx(alpha) Ry(beta) of link i times Rz(theta) Tz(d) of link i + 1.
    """
    origins = []
    before = model.mount
    for theta, d, a, alpha, beta in model.links.tolist():
        origins.append(before @ joint_frame(theta, d))
        before = arm_frame(a, alpha, beta)
    return JointOrigins(np.array(origins), before)


def geometry_of(
    axes: Float[Array, "joint 4 4"], end: Float[Array, "4 4"], prismatic: Bool[Array, "joint"]
) -> KinematicModel:
    """MDH links through given joint axes, written as a maker would.

    Parameters
    ----------
    axes
        Frame of every joint in the robot base, all joints at zero; it acts along z.
    end
        Frame of the flange, likewise.

    A link may be written with theta or theta + pi (a, alpha and beta then change sign and the next
    link turns by pi): the one within 90 degrees is taken. A base on the first axis and a flange on
    the last one go into their links.
    """
    links, mount, flange = links_from_frames(axes, end)
    if _is_axial(mount):
        links[0, :2] += np.arctan2(mount[1, 0], mount[0, 0]), mount[2, 3]
        mount = np.eye(4)
    half_turn = 0.0
    for link in links[:-1]:
        theta = np.remainder(link[0] + half_turn + np.pi, 2 * np.pi) - np.pi
        half_turn = float(np.copysign(np.pi, theta)) if abs(theta) > _RIGHT_ANGLE else 0.0
        link[0] = theta - half_turn
        if half_turn:
            link[2:] *= -1.0
    flange = joint_frame(half_turn, 0.0) @ flange
    if _is_axial(flange):
        links[-1, :2] = np.arctan2(flange[1, 0], flange[0, 0]), flange[2, 3]
        flange = np.eye(4)
    return KinematicModel(links, prismatic, mount=mount, flange=flange)


def _is_axial(T: Float[Array, "4 4"]) -> bool:
    """Whether a frame is no more than a turn about and a shift along z."""
    across = np.abs([*T[:2, 2], *T[2, :2], *T[:2, 3]])
    return bool(across.max() < _AXIAL and T[2, 2] > 0)


def revolute_geometry(chain: JointOrigins) -> KinematicModel:
    """MDH links of a chain of revolute joints."""
    frames = np.empty_like(chain.origins)
    T = np.eye(4)
    for joint, origin in enumerate(chain.origins):
        T = T @ origin
        frames[joint] = T
    return geometry_of(frames, T @ chain.end, np.zeros(len(frames), dtype=bool))


def joint_frame(theta: float, d: float) -> Float[Array, "4 4"]:
    """Rz(theta) Tz(d), the part of a link that commutes with its joint's motion."""
    T = np.eye(4)
    T[:2, :2] = [[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]]
    T[2, 3] = d
    return T


def arm_frame(a: float, alpha: float, beta: float) -> Float[Array, "4 4"]:
    """Tx(a) Rx(alpha) Ry(beta), the part of a link behind its joint."""
    (ca, cb), (sa, sb) = np.cos([alpha, beta]), np.sin([alpha, beta])
    return np.array([
        [cb, 0.0, sb, a],
        [sa * sb, ca, -sa * cb, 0.0],
        [-ca * sb, sa, ca * cb, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ])


def frame_from_xyz_rpy(
    xyz: Float[Array, "3"], rpy: Float[Array, "3"], order: str = "zyx"
) -> Float[Array, "4 4"]:
    """Frame of a translation [m] and angles about x, y, z [rad]."""
    T = np.eye(4)
    T[:3, :3] = rotation_from_angles(rpy, order)
    T[:3, 3] = xyz
    return T


def xyz_rpy(T: Float[Array, "4 4"]) -> tuple[list[float], list[float]]:
    """Translation [m] and URDF's roll, pitch, yaw [rad] of a frame."""
    # Adding zero makes a plain zero of -0.0, which looks like a mistake in a file.
    xyz = [float(value) + 0.0 for value in T[:3, 3]]
    rpy = [float(value) + 0.0 for value in angles_from_rotation(T[:3, :3], "zyx")]
    return xyz, rpy
