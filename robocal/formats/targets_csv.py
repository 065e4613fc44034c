"""Tables of wanted tool poses, and of the joints that really reach them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.compensation import Compensation
from robocal.errors import BadInput
from robocal.formats.measurements_csv import (
    POSITION,
    QUATERNION,
    joint_columns,
    known_columns,
    read_joints,
    rows_at,
)
from robocal.formats.table import Table, read_table, write_table
from robocal.frames import rotation_from_quaternion
from robocal.measurements import MeasurementSet
from robocal.reach import Reach
from robocal.robots.robot import Robot

_UNIT_TOLERANCE = 1e-2
"""By how much a quaternion's length may be off through rounding in the file."""


@dataclass(frozen=True)
class Targets:
    """Wanted tool poses.

    Parameters
    ----------
    table
        The file as it was read.
    wanted
        Tool poses [m].
    nominal_q
        Joints that the nominal robot would use [rad or m], where the file gives them.
    rows
        What the file says of the moment: payload, temperature, approach; joints are zero where it
        gives none.
    """

    table: Table
    wanted: Float[Array, "pose 4 4"]
    nominal_q: Float[Array, "pose joint"] | None
    rows: MeasurementSet


def read_targets(path: Path, robot: Robot) -> Targets:
    """Targets of `robocal compensate`: x_mm ... qz, and where known the nominal joints.

    Raises
    ------
    BadInput
        Naming line and column.
    """
    table = read_table(path)
    table.refuse_unknown(known_columns(robot))
    table.require((*POSITION, *QUATERNION), "a target is a full tool pose")
    wanted = np.zeros((len(table.cells), 4, 4))
    wanted[:, :3, 3] = table.complete(POSITION) * 1e-3
    quaternion = table.complete(QUATERNION)
    length = np.linalg.norm(quaternion, axis=1)
    off = np.abs(length - 1.0) > _UNIT_TOLERANCE
    if off.any():
        row = int(np.argmax(off))
        reason = f"quaternion qw, qx, qy, qz has length {length[row]:.4g}, must be 1"
        raise BadInput(f"{table.file} line {table.lines[row]}", reason)
    wanted[:, :3, :3] = rotation_from_quaternion(quaternion)
    wanted[:, 3, 3] = 1.0
    nominal_q = _nominal_joints(table, robot)
    joints = np.zeros((len(wanted), robot.n_joints)) if nominal_q is None else nominal_q
    return Targets(table, wanted, nominal_q, rows_at(table, robot, joints))


def _nominal_joints(table: Table, robot: Robot) -> Float[Array, "row joint"] | None:
    columns = joint_columns(robot)
    if not any(column in table for column in columns):
        return None
    q = read_joints(table, robot)
    table.complete(columns)
    return q


def write_compensated(path: Path, targets: Targets, robot: Robot, result: Compensation) -> None:
    """The targets' own columns, with the compensated joints, status and remaining error.

    Where a target was not reached, or only in another configuration, the joints stay empty, so
    that no robot is driven there.

    Raises
    ------
    BadInput
        If the file cannot be written.
    """
    table = targets.table
    joints = joint_columns(robot)
    columns = {name: table.text(name) for name in table.header if name not in joints}
    withheld = (Reach.not_reached, Reach.other_configuration)
    given = np.array([reach not in withheld for reach in result.reach])
    for joint, name in enumerate(joints):
        values = result.q[:, joint] / robot.joint_scale[joint]
        columns[name] = tuple(
            f"{value:.9f}" if known else ""
            for value, known in zip(values.tolist(), given.tolist(), strict=True)
        )
    columns["status"] = tuple(result.reach)
    columns["position_error_mm"] = tuple(f"{e:.6f}" for e in (result.position_error * 1e3).tolist())
    columns["angle_error_deg"] = tuple(f"{e:.7f}" for e in np.degrees(result.angle_error).tolist())
    try:
        write_table(path, columns)
    except OSError as error:
        raise BadInput(str(path), f"cannot be written: {error.strerror}") from None
