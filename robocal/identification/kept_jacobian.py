"""The last Jacobian of some rows, kept while the same robot is asked about.

Structure, fit and scores of a few rows ask for the Jacobian at one robot in turn; for 50 poses that
is most of the work.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.kinematics.forward import Columns
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel

MOST_ROWS = 1000
"""More rows are computed in blocks of so many and not kept: memory stays flat."""


class KeptJacobian:
    """Target frames of some rows and their derivatives by every parameter.

    Parameters
    ----------
    joints
        Joint readings of the rows [rad or m].
    """

    def __init__(self, joints: Float[Array, "row joint"]) -> None:
        self._joints = joints
        self._last: tuple[KinematicModel, Columns, Float[Array, "parameter 6 row"]] | None = None

    def at(
        self, model: KinematicModel, block: slice
    ) -> tuple[Columns, Float[Array, "parameter 6 _"]]:
        """As `pose_jacobian` for a block of rows; not to be written to."""
        if len(self._joints) > MOST_ROWS:
            return pose_jacobian(model, self._joints[block])
        last = self._last
        if last is None or not _same(last[0], model):
            last = (model, *pose_jacobian(model, self._joints))
            self._last = last
        return last[1:]


def _same(one: KinematicModel, other: KinematicModel) -> bool:
    """Whether two robots differ in nothing; constant frames are taken over, never copied."""
    return (
        one.station is other.station
        and one.mount is other.mount
        and one.flange is other.flange
        and one.prismatic is other.prismatic
        and bool(np.array_equal(one.vector, other.vector))
    )
