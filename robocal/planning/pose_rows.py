"""What every candidate pose says of the parameters: whitened rows, columns scaled.

Rows are divided by the instrument's standard deviation, so that position and orientation count as
what they are worth. Columns are divided by their root mean square over the candidates, so that
metres and radians are alike: an index near one means a set as good as poses whose columns are
orthogonal, and O2 to O5 do not hang on the choice of units.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.identification.redundancy import find_redundancy
from robocal.kinematics.forward import blocks, forward_kinematics
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel, parameter_names
from robocal.planning.cell import Cell
from robocal.robots.robot import Robot

_STRUCTURE_POSES = 120
"""Candidates from which it is judged which parameters can be told apart"""


@dataclass(frozen=True)
class PoseRows:
    """Rows of every candidate."""

    J: Float[Array, "pose row parameter"]
    """Whitened, columns scaled to mean square one a pose; [1]"""
    scale: Float[Array, "parameter"]
    """What the columns were divided by [1/m, 1/rad]."""
    parameters: Int[Array, "parameter"]
    """Identifiable ones, in the order of `parameter_names`."""
    moves: Float[Array, "pose row joint"]
    """Whitened effect of each joint's own reading [1/rad, 1/m]."""
    model: KinematicModel

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the identifiable parameters."""
        every = parameter_names(self.model.n_joints)
        return tuple(every[index] for index in self.parameters)

    @property
    def fewest(self) -> int:
        """Poses below which the numbers are fewer than the parameters."""
        return int(-(-self.J.shape[2] // self.J.shape[1]))

    def position_rows(self, q: Float[Array, "test joint"]) -> Float[Array, "test 3 parameter"]:
        """How the scaled parameters move the target at other poses [m]."""
        J = _position_and_rotation(self.model, q)[:, :3, self.parameters]
        return np.asarray(J / self.scale)


def pose_rows(robot: Robot, cell: Cell, q: Float[Array, "pose joint"]) -> PoseRows:
    """Rows of candidates [rad or m], as the cell's instrument would see them.

    Without a station the instrument is taken to stand at the robot base.
    """
    model, noise = cell.model(robot), cell.noise
    station = (0.0, 0.0, 0.0) if cell.station is None else cell.station.position
    position = forward_kinematics(model, q)[:, :3, 3]
    J = _position_and_rotation(model, q)
    J[:, :3] /= noise.position_std(position - np.array(station))[:, None, None]
    J[:, 3:] /= noise.orientation_std()
    J = J if cell.sees_orientation else J[:, :3]
    # The triangular factor has the columns' lengths and angles in fewer rows.
    some = np.asarray(np.linalg.qr(J[:_STRUCTURE_POSES].reshape(-1, model.n_parameters), mode="r"))
    unbounded = np.full(model.n_parameters, np.inf)
    everything = np.ones(model.n_parameters, dtype=bool)
    kept = np.flatnonzero(find_redundancy(some, model, everything, unbounded).identified)
    scaled, scale = scale_columns(J[:, :, kept])
    reading = 5 * np.arange(model.n_joints) + np.where(model.prismatic, 1, 0)
    return PoseRows(scaled, scale, kept, J[:, :, reading], model)


def scale_columns(
    J: Float[Array, "pose row parameter"],
) -> tuple[Float[Array, "pose row parameter"], Float[Array, "parameter"]]:
    """Columns of mean square one a pose, and what they were divided by."""
    scale = np.sqrt((J * J).sum(axis=(0, 1)) / len(J))
    return J / scale, scale


def _position_and_rotation(
    model: KinematicModel, q: Float[Array, "pose joint"]
) -> Float[Array, "pose 6 parameter"]:
    J = np.empty((len(q), 6, model.n_parameters))
    for block in blocks(len(q), 500):
        J[block] = pose_jacobian(model, q[block])[1].transpose(2, 1, 0)
    return J
