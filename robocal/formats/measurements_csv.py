"""`measurements.csv`: one row an observation, columns as the contract names them."""

from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.fields import LARGEST
from robocal.formats.table import Table, read_table
from robocal.measurements import MeasurementSet, approach_column
from robocal.robots.robot import Robot

POSITION = ("x_mm", "y_mm", "z_mm")
QUATERNION = ("qw", "qx", "qy", "qz")
PREDICTED_STD = ("u_x_mm", "u_y_mm", "u_z_mm")
"""Standard uncertainty of a predicted position; of measured rows the instrument states it."""
_ONE_POSE = 0.05
"""Repeats of one pose do not differ by more [rad or m]"""
_HEAVIEST = 1e4
"""Four times what the largest industrial robots carry [kg]"""
_SINGLE = (
    "distance_mm",
    "pose",
    "repeat",
    "target",
    "t_s",
    "temperature_degc",
    "payload_kg",
    "speed",
    "settle_s",
    "split",
)


def joint_columns(robot: Robot, prefix: str = "j") -> tuple[str, ...]:
    """Column names of the joints: j1_deg, j2_deg, j3_mm ..."""
    return tuple(f"{prefix}{i + 1}_{unit}" for i, unit in enumerate(robot.joint_units))


def approach_columns(robot: Robot) -> tuple[str, ...]:
    """Column names of the directions of approach: approach1 ..."""
    return tuple(approach_column(joint + 1) for joint in range(robot.n_joints))


def known_columns(robot: Robot) -> tuple[str, ...]:
    """Every column that a bundle of this robot may have."""
    return (
        *joint_columns(robot),
        *POSITION,
        *QUATERNION,
        *PREDICTED_STD,
        *_SINGLE,
        *approach_columns(robot),
        *joint_columns(robot, "cmd"),
    )


def read_joints(table: Table, robot: Robot) -> Float[Array, "row joint"]:
    """Joint readings of every row [rad or m], NaN where a cell is empty.

    Raises
    ------
    BadInput
        If a joint column is missing, or the table has more joints than the robot.
    """
    columns = joint_columns(robot)
    table.require(columns, f"robot '{robot.name}' has {robot.n_joints} joints")
    extra = [f"j{robot.n_joints + 1}_{unit}" for unit in ("deg", "mm")]
    for column in extra:
        if column in table:
            raise BadInput(
                f"{table.file} line 1",
                f"column '{column}' is there, but robot '{robot.name}' has {robot.n_joints} joints",
            )
    return np.asarray(_matrix(table, columns) * robot.joint_scale)


def _matrix(table: Table, columns: tuple[str, ...]) -> Float[Array, "row column"]:
    return np.column_stack([table.numbers(column) for column in columns])


def read_measurements(path: Path, robot: Robot) -> tuple[MeasurementSet, tuple[str, ...]]:
    """All rows of the file, and the text of its `split` column (empty where it has none).

    Raises
    ------
    BadInput
        Naming line and column.
    """
    table = read_table(path)
    read_joints(table, robot)
    table.refuse_unknown(known_columns(robot))
    if "distance_mm" not in table:
        table.require(POSITION, "a row needs a position in mm, or distance_mm")
    if any(column in table for column in QUATERNION):
        table.require(QUATERNION, "an orientation needs all four")
    return rows_of(table, robot), table.text("split")


def rows_of(table: Table, robot: Robot) -> MeasurementSet:
    """Rows of a table that has the joints; whatever else it lacks is NaN.

    Raises
    ------
    BadInput
        Naming line and column.
    """
    return rows_at(table, robot, read_joints(table, robot))


def rows_at(table: Table, robot: Robot, joints: Float[Array, "row joint"]) -> MeasurementSet:
    """Rows of a table whose joints are known otherwise [rad or m]; what else it lacks is NaN.

    Raises
    ------
    BadInput
        Naming line and column.
    """
    n_rows = len(table.cells)
    table.numbers("repeat")
    return MeasurementSet(
        lines=table.lines,
        joints=joints,
        position=_matrix(table, POSITION) * 1e-3,
        orientation=_orientation(table),
        distance=table.numbers("distance_mm") * 1e-3,
        pose=_pose_numbers(table, joints),
        target=table.text("target"),
        held_out=np.zeros(n_rows, dtype=bool),
        time=table.numbers("t_s"),
        temperature=table.numbers("temperature_degc"),
        payload=_between(table, "payload_kg", _HEAVIEST, "a mass in kg"),
        speed=_between(table, "speed", 1.0, "a fraction of full speed"),
        settle=_between(table, "settle_s", LARGEST, "a time in s"),
        approach=_approach(table, robot),
        commanded=_matrix(table, joint_columns(robot, "cmd")) * robot.joint_scale,
    )


def _orientation(table: Table) -> Float[Array, "row 4"]:
    quaternion = _matrix(table, QUATERNION)
    norm = np.linalg.norm(quaternion, axis=1)
    off = np.abs(norm - 1.0) > 1e-2
    if off.any():
        row = int(np.argmax(off))
        raise BadInput(
            f"{table.file} line {table.lines[row]}",
            f"quaternion qw, qx, qy, qz has length {norm[row]:.4g}, must be 1",
        )
    # Rows with a part missing keep the others, so that `unusable_rows` can name them.
    whole = np.isfinite(norm)
    quaternion[whole] /= norm[whole, None]
    return quaternion


def _between(table: Table, column: str, most: float, what: str) -> Float[Array, "row"]:
    """A column whose numbers lie between zero and `most`."""
    values = table.numbers(column)
    wrong = (values < 0.0) | (values > most)
    if wrong.any():
        row = int(np.argmax(wrong))
        raise BadInput(
            f"{table.file} line {table.lines[row]}",
            f"column '{column}' must be {what}, from 0 to {most:g}, not {values[row]:g}",
        )
    return values


def _approach(table: Table, robot: Robot) -> Float[Array, "row joint"]:
    """Directions in which the joints last moved."""
    directions = _matrix(table, approach_columns(robot))
    wrong = ~(np.isnan(directions) | np.isin(directions, (-1.0, 0.0, 1.0)))
    if wrong.any():
        row, joint = np.argwhere(wrong)[0]
        raise BadInput(
            f"{table.file} line {table.lines[row]}",
            f"column 'approach{joint + 1}' must be -1, 0 or 1, not {directions[row, joint]:g}",
        )
    return directions


def _pose_numbers(table: Table, joints: Float[Array, "row joint"]) -> Array:
    """Numbers of the poses; without a column rows with equal joints share one."""
    if "pose" not in table:
        readings = np.round(joints, 9)
        _, first, same = np.unique(readings, axis=0, return_index=True, return_inverse=True)
        return np.asarray(np.argsort(np.argsort(first))[same.ravel()])
    numbers = table.numbers("pose")
    wrong = np.isnan(numbers) | (numbers != np.round(numbers))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise BadInput(
            f"{table.file} line {table.lines[row]}", "column 'pose' must be a whole number"
        )
    if len(numbers) > 1 and (numbers == numbers[0]).all():
        known = joints[np.isfinite(joints).all(axis=1)]
        if len(known) and np.ptp(known, axis=0).max() > _ONE_POSE:
            raise BadInput(
                table.file,
                f"column 'pose' is {numbers[0]:g} in every row, but the joints differ: only "
                "repeats of one pose share a number",
            )
    return numbers.astype(int)


def held_out_by_column(file: str, lines: Array, split: tuple[str, ...]) -> Bool[Array, "row"]:
    """Rows whose split is `check`.

    Raises
    ------
    BadInput
        If a cell is neither `fit` nor `check`.
    """
    for line, cell in zip(lines, split, strict=True):
        if cell not in ("fit", "check"):
            raise BadInput(
                f"{file} line {line}", f"column 'split' must be fit or check, not '{cell}'"
            )
    return np.array([cell == "check" for cell in split])
