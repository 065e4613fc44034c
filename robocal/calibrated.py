"""The calibrated robot as others use it: identified model, covariance, provenance."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.kinematics.forward import blocks, forward_kinematics
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel
from robocal.robots.robot import Robot


@dataclass(frozen=True)
class Provenance:
    """Where a model comes from, so that it can be computed again."""

    bundle_sha256: str
    software_version: str
    date: str
    strategy: str


@dataclass(frozen=True)
class CalibratedRobot:
    """What `model.yaml` holds.

    Parameters
    ----------
    robot
        Nominal robot.
    model
        Identified geometry; `base` and `tool` are zero, the identified frames stand in `station`
        and `flange`.
    covariance
        Of all parameters [m, rad], zero for those that were not identified; the frames' part is in
        small shifts and turns along the frame's own axes.
    gravity
        Direction of gravity in the robot base.
    """

    robot: Robot
    model: KinematicModel
    covariance: Float[Array, "parameter parameter"]
    gravity: Float[Array, "3"]
    provenance: Provenance

    def tool_poses(self, q: Float[Array, "pose joint"]) -> Float[Array, "pose 4 4"]:
        """Target poses in the measuring frame at joint readings [rad or m]."""
        return forward_kinematics(self.model, q)

    def tool_position_covariance(self, q: Float[Array, "pose joint"]) -> Float[Array, "pose 3 3"]:
        """Covariance of the target's position [m2] by the law of propagation (GUM, 5.1.2)."""
        result = np.empty((len(q), 3, 3))
        for block in blocks(len(q), 500):
            _, J = pose_jacobian(self.model, q[block])
            J_position = np.moveaxis(J[:, :3], 2, 0)
            result[block] = np.einsum(
                "mpi,pk,mkj->mij", J_position, self.covariance, J_position, optimize=True
            )
        return result
