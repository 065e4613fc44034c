"""MDH links of an arm that is known by its joint axes: robots described in other conventions."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

_NEARLY_PARALLEL = 0.05
"""Below this sine of their angle two axes count as parallel: their common normal would lie metres
away, and kilometres where a file rounds pi/2 to 1.5708; [1]"""
_ROUNDING = 1e-12
"""[m]"""


def links_from_frames(
    joints: Float[Array, "joint 4 4"], end: Float[Array, "4 4"]
) -> tuple[Float[Array, "joint 5"], Float[Array, "4 4"], Float[Array, "4 4"]]:
    """MDH links through given joint axes.

    Joint i acts along z of its frame (all frames in the robot base, all joints at zero). A link has
    beta = 0, or d = 0 where the next axis is parallel or nearly so (Hayati's choice).

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
    w, between = frame[:3, :3].T @ axis, frame[:3, :3].T @ (point - frame[:3, 3])
    sine = float(np.hypot(w[0], w[1]))
    if sine < _NEARLY_PARALLEL:
        return _through_parallel_axis(w, between)
    normal = np.array([-w[1], w[0], 0.0]) / sine
    # Feet of the common normal on both lines.
    d, _, a = np.linalg.solve(np.column_stack([(0.0, 0.0, 1.0), -w, normal]), between)
    return np.array([np.arctan2(normal[1], normal[0]), d, a, np.arctan2(sine, w[2]), 0.0])


def _through_parallel_axis(w: Float[Array, "3"], between: Float[Array, "3"]) -> Float[Array, "5"]:
    """Hayati's link to the line through `between` along `w`, both in the present frame.

    x goes to where that line meets the plane z = 0; alpha and beta tilt z onto it.
    """
    foot = between - w * (between[2] / w[2])
    foot[np.abs(foot) < _ROUNDING] = 0.0  # on one line, rounding must not choose a direction
    a, theta = np.hypot(foot[0], foot[1]), np.arctan2(foot[1], foot[0])
    along = w[0] * np.cos(theta) + w[1] * np.sin(theta)
    across = w[1] * np.cos(theta) - w[0] * np.sin(theta)
    return np.array([theta, 0.0, a, np.arctan2(-across, w[2]), np.arcsin(along)])


def _link(step: Float[Array, "5"]) -> Float[Array, "4 4"]:
    """Link transform Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)."""
    theta, d, a, alpha, beta = step
    (ct, ca, cb), (st, sa, sb) = np.cos([theta, alpha, beta]), np.sin([theta, alpha, beta])
    return np.array([
        [ct * cb - st * sa * sb, -st * ca, ct * sb + st * sa * cb, a * ct],
        [st * cb + ct * sa * sb, ct * ca, st * sb - ct * sa * cb, a * st],
        [-ca * sb, sa, ca * cb, d],
        [0.0, 0.0, 0.0, 1.0],
    ])
