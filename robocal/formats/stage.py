"""`stage.yaml` and `touches.csv`: a base-to-base calibration with the sensing stage."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.base_calibration.arm import Arm
from robocal.base_calibration.corrections import CORRECTIONS, default_prior_std
from robocal.base_calibration.next_touch import Pair, Travel
from robocal.base_calibration.stage import Readings, Stage
from robocal.base_calibration.touches import Touches
from robocal.errors import BadInput
from robocal.formats.fields import Fields, read_fields
from robocal.formats.measurements_csv import joint_columns
from robocal.formats.model_yaml import read_model
from robocal.formats.robot_yaml import plain_file_name, read_robot
from robocal.formats.table import Table, read_table
from robocal.kinematics.model import KinematicModel
from robocal.robots.robot import Robot

_MM, _MRAD, _DEG = 1e-3, 1e-3, np.pi / 180.0
_LARGEST_SIGMA = 1000.0
"""Beyond it a sensor says nothing, and sums lose the digits of the others [mm, mrad]"""
_BEYOND = 0.1
"""A joint at its stop may read this much beyond its limit [deg or mm]"""
_NO_TRAVEL = 1.0
"""A sliding joint that is never this far from zero is taken for one in metres [mm]"""
_READINGS = ("slide_mm", "rod_angle_deg", "rod_length_mm")
_ROBOTS, _CUPS = ("master", "slave"), ("slide", "rod")


@dataclass(frozen=True)
class StageCalibration:
    """Everything that a stage file says, in SI."""

    stage: Stage
    travel: Travel
    touches: Touches
    pair: Pair


def read_stage(path: Path) -> StageCalibration:
    """A stage file with its robots and touches.

    Raises
    ------
    BadInput
        Naming file, line and field.
    """
    fields = read_fields(path)
    robots = [_read_arm(fields.mapping(name), path.parent) for name in _ROBOTS]
    section = fields.mapping("stage")
    stage, travel = _stage(section), _travel(section)
    section.finish()
    table = read_table(path.parent / plain_file_name(fields, "touches"))
    fields.finish()
    touches, joints = _touches(table, robots)
    pair = Pair(robots[0][1], robots[1][1], joints[0], joints[1])
    return StageCalibration(stage, travel, touches, pair)


def _read_arm(fields: Fields, folder: Path) -> tuple[Robot, Arm]:
    """A robot by its nominal geometry (`robot`) or its identified one (`model`)."""
    needle = np.concatenate([np.array(fields.numbers("needle_mm", 3)) * _MM, np.zeros(3)])
    if "model" in fields:
        calibrated = read_model(folder / plain_file_name(fields, "model"))
        if calibrated.effects:
            names = ", ".join(fitted.instance.title for fitted in calibrated.effects)
            raise fields.error(
                "model", f"has effects, which touches are not corrected for: {names}"
            )
        robot, links = calibrated.robot, calibrated.model.links
        n = 5 * robot.n_joints
        covariance = calibrated.covariance[:n, :n]
    else:
        robot = read_robot(folder / plain_file_name(fields, "robot"))
        links, covariance = robot.geometry.links, None
    geometry = robot.geometry
    model = KinematicModel(
        links, geometry.prismatic, tool=needle, mount=geometry.mount, flange=geometry.flange
    )
    sigma_tip = _positive(fields, "sigma_mm", Arm.sigma_tip / _MM) * _MM
    sigma_joint = fields.number("sigma_joint_mrad", Arm.sigma_joint / _MRAD) * _MRAD
    if sigma_joint < 0:
        raise fields.error("sigma_joint_mrad", "must not be negative")
    fields.finish()
    return robot, Arm(model, robot.limits, sigma_tip, sigma_joint, covariance)


def _positive(fields: Fields, name: str, default: float | None = None) -> float:
    value = fields.deviation(name, default)
    if value > _LARGEST_SIGMA:
        raise fields.error(name, f"must not be above {_LARGEST_SIGMA:g}, not {value:g}")
    return value


def _stage(fields: Fields) -> Stage:
    return Stage(
        sigma_slide=_positive(fields, "sigma_slide_mm") * _MM,
        sigma_rod=_positive(fields, "sigma_rod_mm") * _MM,
        sigma_angle=_positive(fields, "sigma_angle_mrad") * _MRAD,
        level_in_master=fields.flag("level_in_master", default=False),
        level_in_slave=fields.flag("level_in_slave", default=False),
        sigma_level=_positive(fields, "sigma_level_mrad", Stage.sigma_level / _MRAD) * _MRAD,
        prior_std=_prior_std(fields),
    )


def _prior_std(fields: Fields) -> Float[Array, "correction"]:
    """`prior_std`: how far each sensor may be off; zero fixes a correction."""
    prior_std = default_prior_std()
    if "prior_std" not in fields:
        return prior_std
    given = fields.mapping("prior_std")
    for k, correction in enumerate(CORRECTIONS):
        if correction.field in given:
            value = given.number(correction.field)
            if value != 0:
                value = given.deviation(correction.field)
            prior_std[k] = value * correction.scale
    given.finish()
    return prior_std


def _travel(fields: Fields) -> Travel:
    return Travel(
        slide=_range(fields, "slide_range_mm", _MM, Travel.slide),
        angle=_range(fields, "rod_angle_range_deg", _DEG, Travel.angle) or Travel.angle,
        length=_range(fields, "rod_length_range_mm", _MM, Travel.length),
    )


def _range(
    fields: Fields, name: str, unit: float, default: tuple[float, float] | None
) -> tuple[float, float] | None:
    if name not in fields:
        return default
    low, high = fields.numbers(name, 2)
    if low >= high:
        raise fields.error(name, f"has its lower end {low:g} not below its upper end {high:g}")
    return low * unit, high * unit


def _touches(
    table: Table, robots: list[tuple[Robot, Arm]]
) -> tuple[Touches, list[Float[Array, "_ joint"]]]:
    columns = [joint_columns(robot) for robot, _ in robots]
    table.require(("robot", "cup", *_READINGS), "every touch needs robot, cup and three readings")
    for name, needed in zip(_ROBOTS, columns, strict=True):
        table.require(needed, f"the {name} has {len(needed)} joints")
    table.refuse_unknown(("robot", "cup", *_READINGS, "placement", *columns[0], *columns[1]))
    by_slave = _choice(table, "robot", _ROBOTS)
    on_rod = _choice(table, "cup", _CUPS)
    joints = [
        _joints(table, needed, robot, by_slave == side)
        for side, (needed, (robot, _)) in enumerate(zip(columns, robots, strict=True))
    ]
    poses = np.empty((len(by_slave), 4, 4))
    covariance = np.zeros((3 * len(by_slave), 3 * len(by_slave)))
    for side, (_, arm) in enumerate(robots):
        poses[by_slave == side] = arm.needle_poses(joints[side])
        rows = np.flatnonzero(np.repeat(by_slave == side, 3))
        covariance[np.ix_(rows, rows)] = arm.tip_covariance(joints[side])
    return (
        Touches(
            table.lines,
            by_slave,
            on_rod,
            _placement(table),
            _readings(table, on_rod),
            poses,
            covariance,
        ),
        joints,
    )


def _choice(table: Table, column: str, words: tuple[str, str]) -> Bool[Array, "touch"]:
    """True where the cell is the second of two words."""
    for line, cell in zip(table.lines, table.text(column), strict=True):
        if cell not in words:
            raise BadInput(
                f"{table.file} line {line}",
                f"column '{column}' must be {words[0]} or {words[1]}, not '{cell[:40]}'",
            )
    return np.array([cell == words[1] for cell in table.text(column)])


def _numbers(
    table: Table, column: str, needed: Bool[Array, "touch"], why: str
) -> Float[Array, "touch"]:
    """One column that must be filled where `needed`."""
    values = table.numbers(column)
    empty = needed & np.isnan(values)
    if empty.any():
        line = table.lines[int(np.argmax(empty))]
        raise BadInput(f"{table.file} line {line}", f"column '{column}' is empty; {why}")
    return values


def _joints(
    table: Table, columns: tuple[str, ...], robot: Robot, own: Bool[Array, "touch"]
) -> Float[Array, "_ joint"]:
    why = f"robot '{robot.name}' made this touch"
    values = np.column_stack([_numbers(table, column, own, why) for column in columns])
    low, high = (robot.limits / robot.joint_scale[:, None]).T
    outside = own[:, None] & ((values < low - _BEYOND) | (values > high + _BEYOND))
    if outside.any():
        row, joint = np.argwhere(outside)[0]
        raise BadInput(
            f"{table.file} line {table.lines[row]}",
            f"column '{columns[joint]}' is {values[row, joint]:g}, outside the limits "
            f"{low[joint]:g} to {high[joint]:g} of robot '{robot.name}'",
        )
    _refuse_metres(table, columns, values[own])
    return np.asarray(values[own] * robot.joint_scale)


def _refuse_metres(table: Table, columns: tuple[str, ...], values: Float[Array, "_ joint"]) -> None:
    """A slide alike in all touches only shifts the base: no residual shows its unit."""
    for column, slide in zip(columns, values.T, strict=True):
        largest = np.abs(slide).max(initial=0.0)
        if column.endswith("_mm") and 0.0 < largest < _NO_TRAVEL:
            raise BadInput(
                table.file,
                f"column '{column}' stays below {largest:.2g} mm in every touch, which looks like "
                "metres; write millimetres, or 0 where the joint stands at its zero",
            )


def _readings(table: Table, on_rod: Bool[Array, "touch"]) -> Readings:
    every = np.ones(len(on_rod), dtype=bool)
    slide = _numbers(table, "slide_mm", every, "every touch needs it") * _MM
    why = "a touch of the rod cup needs it"
    angle = _numbers(table, "rod_angle_deg", on_rod, why) * _DEG
    length = _numbers(table, "rod_length_mm", on_rod, why) * _MM
    short = on_rod & ~(length > 0)
    if short.any():
        line = table.lines[int(np.argmax(short))]
        raise BadInput(f"{table.file} line {line}", "column 'rod_length_mm' must be above zero")
    return Readings(slide, np.where(on_rod, angle, 0.0), np.where(on_rod, length, 0.0))


def _placement(table: Table) -> Int[Array, "touch"]:
    """Running number from 0 of where the stage stood; one place where the column is missing."""
    if "placement" not in table:
        return np.zeros(len(table.cells), dtype=int)
    every = np.ones(len(table.cells), dtype=bool)
    values = _numbers(table, "placement", every, "number every touch or leave the column out")
    return np.unique(values, return_inverse=True)[1]
