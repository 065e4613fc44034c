r"""Derivative of the target's pose with respect to every geometric parameter, in closed form.

Every parameter is a twist. One that turns the rest of the arm about an axis `w` through a point `c`
moves the target at `p` by

.. math:: \partial p = w \times (p - c), \qquad \partial\varphi = w,

one that shifts it along `v` by :math:`\partial p = v,\ \partial\varphi = 0`. Rotations are
rotation vectors in the measuring frame: :math:`R \to \exp([\partial\varphi]_\times) R`. This is
the patent's error model (figures 3 and 4, corrected as docs/physics.md tells), written in the
measuring frame instead of each link's own.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.kinematics.forward import Columns, walk
from robocal.kinematics.model import KinematicModel


def pose_jacobian(
    model: KinematicModel, q: Float[Array, "pose joint"]
) -> tuple[Columns, Float[Array, "parameter 6 pose"]]:
    """Target frames and their derivatives, for one block of poses.

    Parameters
    ----------
    model
        Robot with its base and tool frames.
    q
        Joint readings [rad], [m] for prismatic joints. Call it in blocks (`forward.blocks`):
        the result takes 48 bytes a parameter and pose.

    Returns
    -------
    target
        Axes and origin of the target frame.
    J
        Rows 0 to 2 position [m/rad or 1], rows 3 to 5 rotation vector [rad/rad or rad/m], in the
        order of `model.parameter_names`.

    References
    ----------
    .. [1] CN117067221B, eq. (8)-(15).
    """
    n_poses = len(q)
    last, joints = walk(model, q)
    flange = last.then(model.flange)
    target = last.then(model.tool_frame)
    J = np.zeros((model.n_parameters, 6, n_poses))
    for link, joint in enumerate(joints):
        theta, d, a, alpha, beta = J[5 * link : 5 * link + 5]
        _turn(theta, joint.z, joint.before, target.p)
        d[:3] = joint.z
        a[:3] = joint.x
        _turn(alpha, joint.x, joint.after, target.p)
        _turn(beta, joint.y, joint.after, target.p)
    station = model.station[:3, :3]
    base_origin = model.base_frame[:3, 3:4]
    _fill_frame(J[-12:-6], station[:, 0:1], station[:, 1:2], station[:, 2:3], model.base)
    for column in J[-9:-6]:
        _turn(column, column[3:], base_origin, target.p)
    _fill_frame(J[-6:], flange.x, flange.y, flange.z, model.tool)
    return target, J


def _turn(
    column: Float[Array, "6 pose"],
    axis: Float[Array, "3 _"],
    point: Float[Array, "3 _"],
    p: Float[Array, "3 pose"],
) -> None:
    """Fill a column for a turn about `axis` through `point`."""
    rx, ry, rz = p - point
    ax, ay, az = axis
    np.subtract(ay * rz, az * ry, out=column[0])
    np.subtract(az * rx, ax * rz, out=column[1])
    np.subtract(ax * ry, ay * rx, out=column[2])
    column[3:] = axis


def _fill_frame(
    columns: Float[Array, "6 6 pose"],
    x: Float[Array, "3 _"],
    y: Float[Array, "3 _"],
    z: Float[Array, "3 _"],
    frame: Float[Array, "6"],
) -> None:
    """Fill the columns of one six-parameter frame as turns about its own origin.

    The yaw axis is z before the turn, the pitch axis is y after yaw, the roll axis x after both.
    """
    for column, axis in zip(columns[:3], (x, y, z), strict=True):
        column[:3] = axis
    (cy, cp), (sy, sp) = np.cos(frame[3:5]), np.sin(frame[3:5])
    directions = ((0.0, 0.0, 1.0), (-sy, cy, 0.0), (cy * cp, sy * cp, -sp))
    for column, direction in zip(columns[3:], directions, strict=True):
        column[3:] = x * direction[0] + y * direction[1] + z * direction[2]
