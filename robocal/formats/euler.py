"""Three-angle orders of other programs, each as angles about x, y, z in a file's column order.

`zyx` is R = Rz(c) Ry(b) Rx(a): URDF's roll, pitch, yaw, pinocchio's rpy, KUKA's C, B, A. `xyz` is
R = Rx(a) Ry(b) Rz(c): Staeubli's, and what Eigen's `eulerAngles(0, 1, 2)` gives.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput

ORDERS = ("zyx", "xyz")


def check_order(order: str | None, why: str) -> str:
    """The order, if one is given and known.

    Raises
    ------
    BadInput
        If it is missing (`why` says what needs it) or unknown.
    """
    choice = "zyx (R = Rz Ry Rx) or xyz (R = Rx Ry Rz)"
    if order is None:
        raise BadInput("option --euler", f"is missing: {why}; choose {choice}")
    if order not in ORDERS:
        raise BadInput("option --euler", f"must be {choice}, not '{order}'")
    return order


def rotation_from_angles(angles: Float[Array, "3"], order: str) -> Float[Array, "3 3"]:
    """Rotation matrix of the angles about x, y, z [rad]."""
    x, y, z = (_turn(axis, float(angle)) for axis, angle in enumerate(angles))
    return np.asarray(z @ y @ x if order == "zyx" else x @ y @ z)


def angles_from_rotation(R: Float[Array, "3 3"], order: str) -> Float[Array, "3"]:
    """Angles about x, y, z [rad] that give back `R` to rounding, at any pitch.

    The last angle is taken from what the first turn leaves, so near pitch = 90 degrees (where
    files say 1.570796327) an arbitrary first angle is made good by the last one.
    """
    if order == "xyz":
        return np.asarray(-angles_from_rotation(R.T, "zyx"))
    z = np.arctan2(R[1, 0], R[0, 0])
    rest = _turn(2, -float(z)) @ R
    y = np.arctan2(-rest[2, 0], rest[0, 0])
    x = np.arctan2(-rest[1, 2], rest[1, 1])
    return np.array([x, y, z])


def _turn(axis: int, angle: float) -> Float[Array, "3 3"]:
    """Turn about one axis."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[first, first] = R[second, second] = np.cos(angle)
    R[second, first] = np.sin(angle)
    R[first, second] = -np.sin(angle)
    return R
