"""What a health check measured against what the calibrated robot should show."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.linalg import block_diag, cholesky, solve_triangular

from robocal.calibrated import CalibratedRobot
from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel
from robocal.measurements import MeasurementSet


@dataclass(frozen=True)
class Residual:
    """Measured less predicted, and how large it may be by chance.

    Parameters
    ----------
    q
        Joint readings [rad or m].
    position
        Measured [m].
    offset
        What the model's effects add to its geometry [m].
    model
        Geometry with the identified frames as its origin.
    whitener
        Lower triangle L of the covariance, noise and the model's own uncertainty together.
    """

    q: Float[Array, "pose joint"]
    position: Float[Array, "pose 3"]
    offset: Float[Array, "pose 3"]
    model: KinematicModel
    whitener: Float[Array, "scalar scalar"]

    def of(self, model: KinematicModel) -> Float[Array, "scalar"]:
        """Whitened residual against another geometry."""
        predicted = forward_kinematics(model, self.q)[:, :3, 3] + self.offset
        return self.whiten((self.position - predicted).ravel())

    def whiten(self, values: Float[Array, "scalar ..."]) -> Float[Array, "scalar ..."]:
        """Values in units of what chance explains."""
        return np.asarray(solve_triangular(self.whitener, values, lower=True))


def residual_of(
    calibrated: CalibratedRobot, rows: MeasurementSet, noise_std: Float[Array, "row"]
) -> Residual:
    """Weigh the rows of a health check.

    Parameters
    ----------
    rows
        Tool positions.
    noise_std
        Of each coordinate of each row: instrument, repeatability, and what the calibration itself
        could not explain [m].

    Raises
    ------
    BadInput
        If an effect of the model depends on a column that the rows lack.
    """
    model = calibrated.model.with_frames_as_origin()
    geometry = calibrated.tool_poses(rows.joints)[:, :3, 3]
    offset = calibrated.poses_of(rows)[:, :3, 3] - geometry
    _, J = pose_jacobian(model, rows.joints)
    columns = J[:, :3].transpose(2, 1, 0).reshape(3 * len(rows), -1)
    noise = block_diag(*[std**2 * np.eye(3) for std in noise_std])
    covariance = noise + columns @ calibrated.covariance @ columns.T
    return Residual(rows.joints, rows.position, offset, model, cholesky(covariance, lower=True))
