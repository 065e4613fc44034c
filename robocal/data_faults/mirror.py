"""A left-handed measuring frame: an axis turned round, or two columns exchanged.

Positions alone cannot say which axis: every left-handed frame becomes right-handed by turning z,
and the base frame absorbs the rest. Full poses can, if their orientation was left as it was.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.data_faults.slip import Fault, Slip
from robocal.formats.measurements_csv import POSITION, QUATERNION
from robocal.measurements import MeasurementSet


@dataclass(frozen=True)
class MirroredPositions:
    """Positions that were meant = matrix times those of the file."""

    matrix: Float[Array, "3 3"]

    def __call__(self, rows: MeasurementSet) -> MeasurementSet:
        """The rows with these positions."""
        return replace(rows, position=rows.position @ self.matrix.T)


@dataclass(frozen=True)
class MirroredPoses:
    """z turned round in positions and orientations: a turn about x or y changes its sign."""

    matrix: Float[Array, "3 3"]

    def __call__(self, rows: MeasurementSet) -> MeasurementSet:
        """The rows with these poses."""
        return replace(
            rows,
            position=rows.position @ self.matrix.T,
            orientation=rows.orientation * np.array([1.0, -1.0, -1.0, 1.0]),
        )


Z_TURNED = np.diag([1.0, 1.0, -1.0])
POSITIONS_MIRRORED = Slip(
    Fault.mirrored_frame,
    POSITION,
    "the measuring frame is left-handed: multiply z_mm by -1",
    MirroredPositions(Z_TURNED),
)
POSES_MIRRORED = Slip(
    Fault.mirrored_frame,
    (*POSITION, *QUATERNION),
    "the measuring frame is left-handed: multiply z_mm, qx and qy by -1",
    MirroredPoses(Z_TURNED),
)


def mirrored_positions_of_poses() -> tuple[tuple[Float[Array, "3 3"], Slip], ...]:
    """The positions alone are mirrored, the orientations are not: each axis, each exchange.

    With the matrix that mends them.
    """
    found = []
    for axis, column in enumerate(POSITION):
        matrix = np.eye(3)
        matrix[axis, axis] = -1.0
        text = f"{column} has its sign turned: multiply it by -1"
        found.append((matrix, _positions_slip((column,), text, matrix)))
    for a, b in ((0, 1), (0, 2), (1, 2)):
        order = [0, 1, 2]
        order[a], order[b] = b, a
        columns = (POSITION[a], POSITION[b])
        text = f"{columns[0]} and {columns[1]} are exchanged: exchange them back"
        matrix = np.eye(3)[order]
        found.append((matrix, _positions_slip(columns, text, matrix)))
    return tuple(found)


def _positions_slip(columns: tuple[str, ...], text: str, matrix: Float[Array, "3 3"]) -> Slip:
    return Slip(Fault.mirrored_frame, columns, text, MirroredPositions(matrix))
