r"""Rigid frames: rotation matrices, yaw-pitch-roll, quaternions, rotation vectors.

Conventions of the patent (see docs/physics.md):
:math:`T(x, y, z, \alpha, \beta, \gamma) = Trans(x, y, z)\,R_z(\alpha)\,R_y(\beta)\,R_x(\gamma)`
with yaw, pitch, roll in this order. `T_a_b` maps coordinates in b to coordinates in a.
Stacks of frames carry the stack index first: ``(pose, 4, 4)``.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array


def frame_from_xyz_ypr(frame: Float[Array, "6"]) -> Float[Array, "4 4"]:
    """Homogeneous transform of the six frame parameters x, y, z [m], yaw, pitch, roll [rad]."""
    T = np.zeros((4, 4))
    T[:3, :3] = rotation_from_ypr(frame[3:])
    T[:3, 3] = frame[:3]
    T[3, 3] = 1.0
    return T


def xyz_ypr_from_frame(T: Float[Array, "4 4"]) -> Float[Array, "6"]:
    """Six frame parameters [m, rad] of a homogeneous transform; pitch within ±pi/2.

    At pitch = ±pi/2 yaw and roll turn about the same line and yaw is arbitrary. Roll is what is
    left once yaw is undone, so that next to that pitch, where yaw is badly known, the three angles
    still stand for the same rotation.
    """
    R = T[:3, :3]
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    yaw = np.arctan2(R[1, 0], R[0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([*T[:3, 3], yaw, pitch, roll])


def rotation_from_ypr(ypr: Float[Array, "3"]) -> Float[Array, "3 3"]:
    """Rotation matrix Rz(yaw) Ry(pitch) Rx(roll) of three angles [rad]."""
    (cy, cp, cr), (sy, sp, sr) = np.cos(ypr), np.sin(ypr)
    return np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])


def invert(T: Float[Array, "*stack 4 4"]) -> Float[Array, "*stack 4 4"]:
    """Inverse of rigid transforms, by transposing the rotation."""
    inverse = np.zeros_like(T)
    R_T = np.swapaxes(T[..., :3, :3], -1, -2)
    inverse[..., :3, :3] = R_T
    inverse[..., :3, 3] = -np.einsum("...ij,...j->...i", R_T, T[..., :3, 3])
    inverse[..., 3, 3] = 1.0
    return inverse


def rotation_from_quaternion(quaternion: Float[Array, "pose 4"]) -> Float[Array, "pose 3 3"]:
    """Rotation matrices of quaternions w, x, y, z; they are normalised first."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def quaternion_from_rotation(R: Float[Array, "pose 3 3"]) -> Float[Array, "pose 4"]:
    """Unit quaternions w, x, y, z with w >= 0, by the best conditioned of four forms.

    References
    ----------
    .. [1] I. Y. Bar-Itzhack, "New method for extracting the quaternion from a rotation matrix",
       J. Guidance 23(6), 2000; the four forms are Shepperd's (J. Guidance 1(3), 1978).
    """
    diagonal = np.einsum("mii->mi", R)
    trace = diagonal.sum(axis=1)
    squares = np.concatenate([trace[:, None], 2 * diagonal - trace[:, None]], axis=1) + 1.0
    skew = np.stack(
        [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1
    )
    outer = np.empty((len(R), 4, 4))
    outer[:, 0, 0] = squares[:, 0]
    outer[:, 0, 1:] = outer[:, 1:, 0] = skew
    outer[:, 1:, 1:] = R + np.swapaxes(R, 1, 2)
    for axis in range(3):
        outer[:, axis + 1, axis + 1] = squares[:, axis + 1]
    best = np.argmax(squares, axis=1)
    quaternion = outer[np.arange(len(R)), best]
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return np.asarray(np.where(quaternion[:, :1] < 0, -quaternion, quaternion))


def rotation_vector(R: Float[Array, "pose 3 3"]) -> Float[Array, "pose 3"]:
    """Rotation vectors (axis times angle in [0, pi]) of rotation matrices [rad]."""
    quaternion = quaternion_from_rotation(R)
    half_sine = np.linalg.norm(quaternion[:, 1:], axis=1)
    angle = 2.0 * np.arctan2(half_sine, quaternion[:, 0])
    # angle / sin(angle/2) tends to 2 as the angle goes to zero.
    factor = np.where(half_sine > 1e-12, angle / np.maximum(half_sine, 1e-300), 2.0)
    return np.asarray(quaternion[:, 1:] * factor[:, None])


def nearest_rotation(M: Float[Array, "3 3"]) -> Float[Array, "3 3"]:
    """The proper rotation closest to `M` in the Frobenius norm."""
    U, _, Vt = np.linalg.svd(M)
    return np.asarray(U @ np.diag([1.0, 1.0, np.sign(np.linalg.det(U @ Vt))]) @ Vt)


def own_moves(coordinates: Float[Array, "6"]) -> Float[Array, "6 6"]:
    """Takes small changes of x, y, z, yaw, pitch, roll to moves along the frame's own axes."""
    back, columns = invert(frame_from_xyz_ypr(coordinates)), []
    for step in np.eye(6) * 1e-6:
        ahead = xyz_ypr_from_frame(back @ frame_from_xyz_ypr(coordinates + step))
        behind = xyz_ypr_from_frame(back @ frame_from_xyz_ypr(coordinates - step))
        columns.append((ahead - behind) / 2e-6)
    return np.column_stack(columns)
