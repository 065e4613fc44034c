"""The calibrated geometry as a plain table, JSON or CSV, for programs that have their own model.

T = base * mount * product of Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta) * flange * tool; joint i adds
its reading to theta (revolute) or d (prismatic). Frames are Trans(x, y, z) Rz(yaw) Ry(pitch)
Rx(roll). `mount` and `flange` belong to the robot's description and are mostly the identity.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.errors import BadInput
from robocal.formats.fields import fields_of, read_text
from robocal.formats.model_export import Difference, Export, ExportOptions, model_difference
from robocal.formats.robot_yaml import (
    frame_document,
    link_document,
    read_frame,
    robot_document,
    robot_from_fields,
)
from robocal.formats.table import Table, read_table
from robocal.frames import frame_from_xyz_ypr, invert
from robocal.kinematics.model import KinematicModel
from robocal.robots.robot import Robot

_FORMAT = "robocal-mdh-1"
_FORMULA = "base * mount * [Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta)] * flange * tool"
_DEG = np.pi / 180.0
_LINK_COLUMNS = ("theta_deg", "d_mm", "a_mm", "alpha_deg", "beta_deg")
_LINK_UNITS = np.array([_DEG, 1e-3, 1e-3, _DEG, _DEG])
_FRAME_COLUMNS = ("x_mm", "y_mm", "z_mm", "yaw_deg", "pitch_deg", "roll_deg")
_FRAME_UNITS = np.array([1e-3, 1e-3, 1e-3, _DEG, _DEG, _DEG])
_BEFORE, _AFTER = ("base", "mount"), ("flange", "tool")
_NO_COVARIANCE = "the table holds no covariance and no provenance"


def _frames(calibrated: CalibratedRobot) -> dict[str, Float[Array, "4 4"]]:
    """The four constant frames, by name."""
    model, geometry = calibrated.model, calibrated.robot.geometry
    tool = invert(geometry.flange) @ model.tool_frame
    return {
        "base": model.base_frame,
        "mount": model.mount,
        "flange": geometry.flange,
        "tool": tool,
    }


def _placed(robot: KinematicModel, frames: dict[str, Float[Array, "4 4"]]) -> KinematicModel:
    return replace(
        robot,
        station=frames["base"],
        mount=frames["mount"],
        flange=frames["flange"] @ frames["tool"],
    )


def mdh_json_export(calibrated: CalibratedRobot, _: ExportOptions) -> Export:
    """Joints with their ranges, and the four frames."""
    identified = replace(
        calibrated.robot.geometry, links=calibrated.model.links, mount=calibrated.model.mount
    )
    robot = robot_document(Robot(calibrated.robot.name, identified, calibrated.robot.limits))
    frames = {name: frame_document(T) for name, T in _frames(calibrated).items()}
    document = {
        "format": _FORMAT,
        "formula": _FORMULA,
        "name": robot["name"],
        "joints": robot["joints"],
        **frames,
    }

    def difference(path: Path) -> Difference:
        return model_difference(calibrated.model, read_mdh_json(path), calibrated.robot.limits)

    return Export(json.dumps(document, indent=1) + "\n", (_NO_COVARIANCE,), difference)


def read_mdh_json(path: Path) -> KinematicModel:
    """The model of a file that `mdh_json_export` wrote.

    Raises
    ------
    BadInput
        Naming line and field.
    """
    # JSON is YAML, so the field reader that names lines serves both.
    fields = fields_of(path.name, read_text(path))
    if fields.text("format") != _FORMAT:
        raise fields.error("format", f"must be {_FORMAT}")
    fields.text("formula")
    frames = {}
    for name in (*_BEFORE, *_AFTER):
        frame = fields.mapping(name)
        frames[name] = frame_from_xyz_ypr(read_frame(frame))
        frame.finish()
    robot = robot_from_fields(fields, path.parent)
    fields.finish()
    return _placed(robot.geometry, frames)


def mdh_csv_export(calibrated: CalibratedRobot, _: ExportOptions) -> Export:
    """One row a frame or joint, in the order of the formula."""
    model = calibrated.model
    frames = _frames(calibrated)
    rows = [",".join(("part", "type", *_LINK_COLUMNS, *_FRAME_COLUMNS))]
    rows += [_frame_row(name, frames[name]) for name in _BEFORE]
    for joint, link in enumerate(model.links):
        kind = "prismatic" if model.prismatic[joint] else "revolute"
        values = (repr(value) for value in link_document(link).values())
        rows.append(",".join((str(joint + 1), kind, *values, *[""] * len(_FRAME_COLUMNS))))
    rows += [_frame_row(name, frames[name]) for name in _AFTER]

    def difference(path: Path) -> Difference:
        return model_difference(model, read_mdh_csv(path), calibrated.robot.limits)

    left_out = (_NO_COVARIANCE, "the CSV table holds no joint ranges")
    return Export("\n".join(rows) + "\n", left_out, difference)


def _frame_row(name: str, T: Float[Array, "4 4"]) -> str:
    document = frame_document(T)
    values = (repr(value) for part in document.values() for value in part)
    return ",".join((name, "frame", *[""] * len(_LINK_COLUMNS), *values))


def read_mdh_csv(path: Path) -> KinematicModel:
    """The model of a file that `mdh_csv_export` wrote.

    Raises
    ------
    BadInput
        Naming line and column.
    """
    table = read_table(path)
    table.require(("part", "type", *_LINK_COLUMNS, *_FRAME_COLUMNS), "an MDH table has it")
    parts = table.text("part")
    n_joints = len(parts) - len(_BEFORE) - len(_AFTER)
    expected = (*_BEFORE, *(str(joint + 1) for joint in range(n_joints)), *_AFTER)
    if n_joints < 1 or parts != expected:
        raise BadInput(
            path.name, f"column 'part' must read {', '.join(_BEFORE)}, 1 ... n, flange, tool"
        )
    joints = slice(len(_BEFORE), len(_BEFORE) + n_joints)
    links = _numbers(table, _LINK_COLUMNS, _LINK_UNITS)[joints]
    poses = _numbers(table, _FRAME_COLUMNS, _FRAME_UNITS)
    frames = {name: frame_from_xyz_ypr(poses[parts.index(name)]) for name in (*_BEFORE, *_AFTER)}
    prismatic = np.array([kind == "prismatic" for kind in table.text("type")[joints]])
    return _placed(KinematicModel(links, prismatic), frames)


def _numbers(
    table: Table, columns: tuple[str, ...], units: Float[Array, "column"]
) -> Float[Array, "row column"]:
    """Values in SI units; an empty cell where its part needs a number is an error."""
    values = np.column_stack([table.numbers(column) for column in columns]) * units
    of_frames = columns is _FRAME_COLUMNS
    for row, part in enumerate(table.text("part")):
        missing = np.isnan(values[row])
        if part.isdigit() is not of_frames and missing.any():
            column = columns[int(np.argmax(missing))]
            raise BadInput(f"{table.file} line {table.lines[row]}", f"column '{column}' is empty")
    return np.asarray(values)
