"""Rigid motions of the true cell as plain 4x4 matrices, one or a stack of them.

Written on its own, from the textbook, so that a sign error in the calibration's kinematics cannot
cancel against the same error here. Angles and shifts may be arrays: the matrices stack like them.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]
Scalars = float | NDArray[np.float64]


def translation(x: Scalars, y: Scalars, z: Scalars) -> Matrix:
    """Shift by (x, y, z) [m]."""
    T = _unit(np.broadcast(x, y, z).shape)
    T[..., 0, 3], T[..., 1, 3], T[..., 2, 3] = x, y, z
    return T


def turn_x(angle: Scalars) -> Matrix:
    """Turn about x by `angle` [rad]."""
    return _plane_turn(angle, 1, 2)


def turn_y(angle: Scalars) -> Matrix:
    """Turn about y by `angle` [rad]."""
    return _plane_turn(angle, 2, 0)


def turn_z(angle: Scalars) -> Matrix:
    """Turn about z by `angle` [rad]."""
    return _plane_turn(angle, 0, 1)


def _plane_turn(angle: Scalars, first: int, second: int) -> Matrix:
    """Turn the first axis towards the second."""
    c, s = np.cos(angle), np.sin(angle)
    T = _unit(np.shape(angle))
    T[..., first, first], T[..., first, second] = c, -s
    T[..., second, first], T[..., second, second] = s, c
    return T


def _unit(shape: tuple[int, ...]) -> Matrix:
    T = np.zeros((*shape, 4, 4))
    T[..., range(4), range(4)] = 1.0
    return T


@dataclass(frozen=True)
class Frame:
    """Where one frame sits in another: Trans(x, y, z) Rz(yaw) Ry(pitch) Rx(roll)."""

    xyz_mm: tuple[float, float, float]
    ypr_deg: tuple[float, float, float]

    def matrix(self) -> Matrix:
        """Homogeneous transform, translation in [m]."""
        x, y, z = (v * 1e-3 for v in self.xyz_mm)
        yaw, pitch, roll = (math.radians(v) for v in self.ypr_deg)
        return translation(x, y, z) @ turn_z(yaw) @ turn_y(pitch) @ turn_x(roll)


def small_turn(rotation: Matrix) -> Matrix:
    """3x3 rotation by the rotation vector `rotation` [rad] (Rodrigues)."""
    angle = np.linalg.norm(rotation, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(np.asarray(rotation), -1, 0)
    skew = np.zeros((*np.shape(x), 3, 3))
    skew[..., 0, 1], skew[..., 0, 2], skew[..., 1, 2] = -z, y, -x
    skew[..., 1, 0], skew[..., 2, 0], skew[..., 2, 1] = z, -y, x
    # np.sinc(t) is sin(pi t) / (pi t): no division by a zero angle.
    first = np.sinc(angle / math.pi)
    second = 0.5 * np.sinc(angle / (2 * math.pi)) ** 2
    return np.asarray(np.eye(3) + first * skew + second * skew @ skew)


def small_motion(shift: Matrix, rotation: Matrix) -> Matrix:
    """Homogeneous transform of a shift [m] after a turn by a rotation vector [rad]."""
    T = _unit(np.broadcast_shapes(np.shape(shift)[:-1], np.shape(rotation)[:-1]))
    T[..., :3, :3] = small_turn(rotation)
    T[..., :3, 3] = shift
    return T


def quaternion(R: Matrix) -> tuple[float, float, float, float]:
    """Give the unit quaternion (w, x, y, z) with w >= 0 of a 3x3 rotation.

    The largest component comes from the diagonal and divides the others, which stays accurate at
    half turns (S. W. Shepperd, *J. Guidance and Control* 1 (1978) 223).
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    squares = (trace, *(2 * R[i, i] - trace for i in range(3)))
    rows = (
        (1 + squares[0], R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]),
        (R[2, 1] - R[1, 2], 1 + squares[1], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]),
        (R[0, 2] - R[2, 0], R[0, 1] + R[1, 0], 1 + squares[2], R[1, 2] + R[2, 1]),
        (R[1, 0] - R[0, 1], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1], 1 + squares[3]),
    )
    best = np.array(rows[int(np.argmax(squares))])
    best /= np.linalg.norm(best)
    w, x, y, z = (float(v) for v in (best if best[0] >= 0 else -best))
    return w, x, y, z
