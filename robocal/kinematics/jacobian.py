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
    n_poses, n_links = len(q), model.n_joints
    last, joints = walk(model, q)
    flange = last.then(model.flange)
    target = last.then(model.tool_frame)
    J = np.zeros((model.n_parameters, 6, n_poses))
    links = J[: 5 * n_links].reshape(n_links, 5, 6, n_poses)
    theta, d, a, alpha, beta = links.swapaxes(0, 1)
    before, after = np.empty((2, n_links, 3, n_poses))
    for link, joint in enumerate(joints):
        theta[link, 3:] = d[link, :3] = joint.z
        alpha[link, 3:] = a[link, :3] = joint.x
        beta[link, 3:] = joint.y
        np.subtract(target.p, joint.before, out=before[link])
        np.subtract(target.p, joint.after, out=after[link])
    _turn(theta, before)
    _turn(alpha, after)
    _turn(beta, after)
    J[-12:-9, :3] = station = model.station[:3, :3, None].swapaxes(0, 1)
    J[-9:-6, 3:] = _ypr_axes(station, model.base)
    _turn(J[-9:-6], (target.p - model.base_frame[:3, 3:4])[None])
    # Where all axes are parallel z is the same for every pose and stands in one column.
    axes = np.broadcast_arrays(flange.x, flange.y, flange.z)
    J[-6:-3, :3] = tool = np.stack(axes)
    J[-3:, 3:] = _ypr_axes(tool, model.tool)
    return target, J


def _turn(columns: Float[Array, "turn 6 pose"], arm: Float[Array, "_ 3 pose"]) -> None:
    """Fill the positions of columns that turn about their rows 3 to 5; `arm` is target - point."""
    ax, ay, az = columns[:, 3], columns[:, 4], columns[:, 5]
    rx, ry, rz = arm[:, 0], arm[:, 1], arm[:, 2]
    np.subtract(ay * rz, az * ry, out=columns[:, 0])
    np.subtract(az * rx, ax * rz, out=columns[:, 1])
    np.subtract(ax * ry, ay * rx, out=columns[:, 2])


def _ypr_axes(axes: Float[Array, "axis 3 _"], frame: Float[Array, "6"]) -> Float[Array, "turn 3 _"]:
    """Axes about which yaw, pitch and roll turn a frame whose parent has these axes.

    The yaw axis is z before the turn, the pitch axis is y after yaw, the roll axis x after both.
    """
    (cy, cp), (sy, sp) = np.cos(frame[3:5]), np.sin(frame[3:5])
    directions = np.array([[0.0, 0.0, 1.0], [-sy, cy, 0.0], [cy * cp, sy * cp, -sp]])
    return np.asarray((directions @ axes.reshape(3, -1)).reshape(axes.shape))
