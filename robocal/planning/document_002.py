"""Rows and parameters as document 002 has them, for its figures beside ours.

A pose gives twelve rows: the three axes n, o, a of the target frame and its position p. The 24
parameters are those of its table 3; base and tool are known.

References
----------
.. [1] X. Wen et al., Chinese Journal of Scientific Instrument, 2022, eq. (4), table 3.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel, parameter_names

PARAMETERS = (
    *(f"theta_{joint}" for joint in range(1, 7)),
    *(f"d_{joint}" for joint in (1, 3, 4, 5, 6)),
    *(f"a_{joint}" for joint in range(1, 7)),
    *(f"alpha_{joint}" for joint in range(1, 7)),
    "beta_2",
)


def document_rows(
    model: KinematicModel, q: Float[Array, "pose joint"]
) -> Float[Array, "pose 12 24"]:
    """Derivatives of n, o, a [1/m or 1/rad] and p [m/m or m/rad], unscaled."""
    target, J = pose_jacobian(model, q)
    names = parameter_names(model.n_joints)
    chosen = J[[names.index(name) for name in PARAMETERS]]  # (24, 6, pose)
    turn = chosen[:, 3:]
    axes = [np.cross(turn, axis[None], axis=1) for axis in (target.x, target.y, target.z)]
    return np.ascontiguousarray(np.concatenate([*axes, chosen[:, :3]], axis=1).transpose(2, 1, 0))
