"""Tables of joints, and of the tool poses that a model predicts for them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.compensation import asked_for
from robocal.diagnosis.diagnosis import NextPoses
from robocal.errors import BadInput
from robocal.formats.measurements_csv import (
    POSITION,
    PREDICTED_STD,
    QUATERNION,
    approach_columns,
    joint_columns,
    known_columns,
    read_joints,
    rows_of,
)
from robocal.formats.table import Table, read_table, table_text, write_table
from robocal.frames import quaternion_from_rotation
from robocal.orientation_of import OrientationOf
from robocal.robots.robot import Robot


@dataclass(frozen=True)
class JointPoses:
    """Joints of a table, each with its line."""

    lines: Int[Array, "pose"]
    joints: Float[Array, "pose joint"]
    """[rad], [m] for prismatic joints."""


def read_poses(path: Path, robot: Robot) -> JointPoses:
    """Joint readings of a CSV file with the columns of measurements.csv.

    Raises
    ------
    BadInput
        Naming line and column.
    """
    table = read_table(path)
    q = _complete_joints(table, robot)
    return JointPoses(table.lines, q)


@dataclass(frozen=True)
class Predicted:
    """What was written into a table."""

    rows: int
    unturned: int
    """Rows without a quaternion, as the model does not know how the tool is turned."""
    at_end: int
    """Rows taken as at the end of the model's campaign, as nothing tells when they are."""
    orientation_of: OrientationOf


def predict_table(
    calibrated: CalibratedRobot,
    poses: Path,
    out: Path,
    orientation_of: OrientationOf | None = None,
) -> Predicted:
    """Fill x_mm ... qz of a table of joints, and how sure x, y, z are by the model's covariance.

    All its other columns are kept as they are.

    A row's `target` says of which nest; without one it is the tool. Quaternions are the flange's
    where the model does not know how the tool is turned; asked for the tool's, they stay empty.

    Raises
    ------
    BadInput
        Naming line and column.
    """
    table = read_table(poses)
    robot = calibrated.robot
    q = _complete_joints(table, robot)
    rows = replace(rows_of(table, robot), joints=q)
    asked, orientation_of = asked_for(calibrated, orientation_of)
    try:
        T = asked.target_poses(rows)
    except BadInput as error:
        raise error.within(table.file) from None
    columns: dict[str, Sequence[str]] = {name: table.text(name) for name in table.header}
    for axis, name in enumerate(POSITION):
        columns[name] = _cells(T[:, axis, 3] * 1e3, 7)
    quaternion = quaternion_from_rotation(T[:, :3, :3])
    unturned = asked.unturned(rows)
    quaternion[unturned] = np.nan
    for part, name in enumerate(QUATERNION):
        columns[name] = _cells(quaternion[:, part], 12)
    variance = np.diagonal(calibrated.position_covariance_of(rows), axis1=1, axis2=2)
    for axis, name in enumerate(PREDICTED_STD):
        columns[name] = _cells(np.sqrt(variance[:, axis]) * 1e3, 7)
    _write(out, columns)
    at_end = calibrated.rows_at_end(rows)
    return Predicted(len(q), int(unturned.sum()), int(at_end.sum()), orientation_of)


def _complete_joints(table: Table, robot: Robot) -> Float[Array, "pose joint"]:
    q = read_joints(table, robot)
    table.refuse_unknown(known_columns(robot))
    missing = np.isnan(q).any(axis=1)
    if missing.any():
        line = table.lines[int(np.argmax(missing))]
        raise BadInput(f"{table.file} line {line}", "a joint reading is missing")
    return q


def write_plan(path: Path, robot: Robot, q: Float[Array, "pose joint"]) -> None:
    """Joints to drive to, one row a pose, in file units."""
    columns: dict[str, Sequence[str]] = {
        "pose": tuple(str(number) for number in range(1, len(q) + 1))
    }
    for joint, name in enumerate(joint_columns(robot)):
        columns[name] = _cells(q[:, joint] / robot.joint_scale[joint], 6)
    _write(path, columns)


def next_poses_text(robot: Robot, poses: NextPoses) -> str:
    """A CSV file's text: what to measure next, from which side each joint comes, the payload."""
    columns: dict[str, Sequence[str]] = {
        "pose": tuple(str(number) for number in range(1, len(poses.q) + 1))
    }
    for joint, name in enumerate(joint_columns(robot)):
        columns[name] = _cells(poses.q[:, joint] / robot.joint_scale[joint], 6)
    for joint, name in enumerate(approach_columns(robot)):
        columns[name] = tuple(f"{side:.0f}" for side in poses.approach[:, joint])
    if np.isfinite(poses.payload).all() and len(poses.payload):
        columns["payload_kg"] = _cells(poses.payload, 6)
    return table_text(columns)


def _write(path: Path, columns: dict[str, Sequence[str]]) -> None:
    try:
        write_table(path, columns)
    except OSError as error:
        raise BadInput(str(path), f"cannot be written: {error.strerror}") from None


def _cells(values: Float[Array, "row"], decimals: int) -> tuple[str, ...]:
    """Numbers as text, empty where there is none."""
    return tuple("" if np.isnan(value) else f"{value:.{decimals}f}" for value in values)
