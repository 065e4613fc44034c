"""MDH links of an arm that is known by its joint axes: robots described in other conventions."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

_PARALLEL = 1e-9
"""Below this sine two axes count as parallel; [1]"""


def links_from_frames(
    joints: Float[Array, "joint 4 4"], end: Float[Array, "4 4"]
) -> tuple[Float[Array, "joint 5"], Float[Array, "4 4"], Float[Array, "4 4"]]:
    """MDH links through given joint axes.

    Joint i acts along z of its frame (all frames in the robot base, all joints at zero). Where the
    next axis is parallel the link has beta = 0 and its own offset d = 0 (Hayati's choice).

    Parameters
    ----------
    joints
        Frame of every joint at zero readings [1, m].
    end
        Frame of the flange at zero readings.

    Returns
    -------
    links
        theta [rad], d [m], a [m], alpha [rad], beta [rad] a row.
    mount
        Constant frame before the first link.
    flange
        Constant frame after the last link.

    References
    ----------
    .. [1] S. Hayati, M. Mirmirani, J. Robotic Systems 2(4), 1985 (parallel axes).
    """
    frame = joints[0].copy()
    mount = frame.copy()
    links = np.zeros((len(joints), 5))
    for joint, following in enumerate(joints[1:]):
        step = _to_next_axis(frame, following[:3, 2], following[:3, 3])
        links[joint] = step
        frame = frame @ _link(step)
    return links, mount, np.linalg.solve(frame, end)


def _to_next_axis(
    frame: Float[Array, "4 4"], axis: Float[Array, "3"], point: Float[Array, "3"]
) -> Float[Array, "5"]:
    """Link parameters that bring z of `frame` onto the line through `point` along `axis`."""
    x, y, z, origin = frame[:3, 0], frame[:3, 1], frame[:3, 2], frame[:3, 3]
    normal = np.cross(z, axis)
    sine = np.linalg.norm(normal)
    between = point - origin
    if sine > _PARALLEL:
        normal /= sine
        # Feet of the common normal on both lines.
        d, _, a = np.linalg.solve(np.column_stack([z, -axis, normal]), between)
        alpha = np.arctan2(sine, z @ axis)
    else:
        offset = between - z * (z @ between)
        a, d = float(np.linalg.norm(offset)), 0.0
        normal = offset / a if a > _PARALLEL else x
        alpha = 0.0 if z @ axis > 0 else np.pi
    theta = np.arctan2(y @ normal, x @ normal)
    return np.array([theta, d, a, alpha, 0.0])


def _link(step: Float[Array, "5"]) -> Float[Array, "4 4"]:
    """Link transform Rz(theta) Tz(d) Tx(a) Rx(alpha), beta being zero here."""
    theta, d, a, alpha, _ = step
    (ct, ca), (st, sa) = np.cos([theta, alpha]), np.sin([theta, alpha])
    return np.array([
        [ct, -st * ca, st * sa, a * ct],
        [st, ct * ca, -ct * sa, a * st],
        [0.0, sa, ca, d],
        [0.0, 0.0, 0.0, 1.0],
    ])
