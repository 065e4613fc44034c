"""Rigid motions of the true cell as plain 4x4 matrices.

Written on its own, from the textbook, so that a sign error in the calibration's kinematics cannot
cancel against the same error here.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


def translation(x: float, y: float, z: float) -> Matrix:
    """Shift by (x, y, z) [m]."""
    T = np.eye(4)
    T[:3, 3] = (x, y, z)
    return T


def turn_x(angle: float) -> Matrix:
    """Turn about x by `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def turn_y(angle: float) -> Matrix:
    """Turn about y by `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])


def turn_z(angle: float) -> Matrix:
    """Turn about z by `angle` [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


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
    angle = float(np.linalg.norm(rotation))
    x, y, z = rotation
    skew = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    # np.sinc(t) is sin(pi t) / (pi t): no division by a zero angle.
    first = np.sinc(angle / math.pi)
    second = 0.5 * np.sinc(angle / (2 * math.pi)) ** 2
    return np.asarray(np.eye(3) + first * skew + second * skew @ skew)


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
