"""The calibrated robot as others use it: identified model, covariance, provenance."""

from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances, Reference, circumstances
from robocal.diagnosis.extended import FittedEffect, predict
from robocal.errors import BadInput
from robocal.frames import invert
from robocal.kinematics.forward import blocks, forward_kinematics
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel
from robocal.measurements import MeasurementSet
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
    effects
        What acts besides the geometry, and what its times and temperatures are counted from.
    """

    robot: Robot
    model: KinematicModel
    covariance: Float[Array, "parameter parameter"]
    gravity: Float[Array, "3"]
    provenance: Provenance
    effects: tuple[FittedEffect, ...] = ()
    reference: Reference = field(default_factory=Reference)

    def tool_poses(self, q: Float[Array, "pose joint"]) -> Float[Array, "pose 4 4"]:
        """Target poses in the measuring frame at joint readings [rad or m], by geometry alone."""
        return forward_kinematics(self.model, q)

    def poses_of(self, rows: MeasurementSet) -> Float[Array, "row 4 4"]:
        """Target poses of rows with all effects acting; what was measured in them is ignored.

        Raises
        ------
        BadInput
            If an effect depends on a column that the rows lack.
        """
        T = self.tool_poses(rows.joints)
        if not self.effects:
            return T
        around = self.circumstances_of(replace(rows, position=T[:, :3, 3]))
        target = predict(self.model, around, self.effects)
        for position, axis in enumerate((target.x, target.y, target.z, target.p)):
            T[:, :3, position] = axis.T
        if not np.isfinite(T).all():
            row = int(np.argmax(~np.isfinite(T).all(axis=(1, 2))))
            names = ", ".join(fitted.instance.title for fitted in self.effects)
            raise BadInput(
                f"line {rows.lines[row]}", f"lacks a column that the model's effects need ({names})"
            )
        return T

    def circumstances_of(self, rows: MeasurementSet) -> Circumstances:
        """What the effects see of rows."""
        tool = invert(self.robot.geometry.flange) @ self.model.tool_frame
        base = self.model.base_frame[:3, :3]
        return circumstances(self.robot, self.gravity, tool[:3, 3], base, rows, self.reference)

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
