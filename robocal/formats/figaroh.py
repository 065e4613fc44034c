"""figaroh's calibration CSV: markers in m and rad, then the joints by name in rad.

Header `x1,y1,z1,phix1,phiy1,phiz1, x2 ...,<joint names>`. The angles are pinocchio's rpy,
R = Rz(phiz) Ry(phiy) Rx(phix), and may be left out. Joints follow in the robot's order, whatever
their names.
"""

import re
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.euler import rotation_from_angles
from robocal.formats.measured_table import MeasuredTable, MeasurementOptions
from robocal.formats.table import Table, read_table
from robocal.frames import quaternion_from_rotation
from robocal.robots.robot import Robot

_POSE = re.compile(r"(?P<part>x|y|z|phix|phiy|phiz)(?P<marker>\d+)")


def read_figaroh(path: Path, robot: Robot, _: MeasurementOptions) -> MeasuredTable:
    """One row a sample and marker.

    Raises
    ------
    BadInput
        Naming line and column.
    """
    table = read_table(path)
    named = [name for name in table.header if not _POSE.fullmatch(name)]
    if len(named) != robot.n_joints:
        reason = f"names {len(named)} joints ({', '.join(named[:10])}), robot '{robot.name}' has "
        raise BadInput(f"{path.name} line 1", f"{reason}{robot.n_joints}; remove the others")
    found = [found for found in map(_POSE.fullmatch, table.header) if found]
    markers = sorted({int(match["marker"]) for match in found})
    if not markers:
        raise BadInput(f"{path.name} line 1", "has no marker; x1, y1, z1 are needed")
    joints = np.column_stack([table.numbers(name) for name in named])
    poses = [_marker(table, marker) for marker in markers]
    nests = tuple(f"marker{marker}" for marker in markers) if len(markers) > 1 else ()
    n_rows, n_markers = len(joints), len(markers)
    other = {"pose": tuple(str(row) for row in range(n_rows)) * n_markers}
    if nests:
        other["target"] = tuple(nest for nest in nests for _ in range(n_rows))
    return MeasuredTable(
        np.tile(joints, (n_markers, 1)),
        np.concatenate([position for position, _ in poses]),
        np.concatenate([orientation for _, orientation in poses]),
        other,
        nests,
        (f"joints in order: {', '.join(named)}", f"{n_markers} markers, {n_rows} samples"),
    )


def _marker(table: Table, marker: int) -> tuple[Float[Array, "row 3"], Float[Array, "row 4"]]:
    """Position [m] and quaternion of one marker, NaN where it was not seen."""
    table.require((f"{axis}{marker}" for axis in "xyz"), "a marker has a position")
    position = np.column_stack([table.numbers(f"{axis}{marker}") for axis in "xyz"])
    names = [f"phi{axis}{marker}" for axis in "xyz"]
    if any(name in table for name in names):
        table.require(names, "an orientation needs all three")
    angles = np.column_stack([table.numbers(name) for name in names])
    orientation = np.full((len(angles), 4), np.nan)
    turned = np.isfinite(angles).all(axis=1)
    if turned.any():
        R = np.array([rotation_from_angles(row, "zyx") for row in angles[turned]])
        orientation[turned] = quaternion_from_rotation(R)
    return position, orientation
