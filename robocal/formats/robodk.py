"""RoboDK's calibration tables (CSV): what `SaveTableCalibration` and its sisters write.

One header row; columns 1 to 6 joints [deg], 7 to 12 measured x, y, z [mm] and three angles [deg],
13 to 18 the tool that was used, likewise. Three zero angles: position only; all six zero: not
measured. RoboDK shows angles in the order of the controller's maker, so `--euler` must say which.
"""

from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.errors import BadInput
from robocal.formats.euler import angles_from_rotation, check_order, rotation_from_angles
from robocal.formats.measured_table import MeasuredTable, MeasurementOptions
from robocal.formats.model_export import (
    Difference,
    Export,
    ExportOptions,
    pose_difference,
    random_joints,
)
from robocal.formats.table import read_table
from robocal.frames import invert, quaternion_from_rotation, rotation_from_quaternion
from robocal.robots.robot import Robot

_HEADER = (
    *(f"J{joint} [deg]" for joint in range(1, 7)),
    *("X [mm]", "Y [mm]", "Z [mm]", "Rx [deg]", "Ry [deg]", "Rz [deg]"),
    *("Tool X [mm]", "Tool Y [mm]", "Tool Z [mm]"),
    *("Tool Rx [deg]", "Tool Ry [deg]", "Tool Rz [deg]"),
)
_WHY = "the file's three angles can be read in two ways"


def read_robodk(path: Path, robot: Robot, options: MeasurementOptions) -> MeasuredTable:
    """Measured rows of a table that RoboDK saved.

    Raises
    ------
    BadInput
        Naming line and column.
    """
    _check_robot(robot)
    table = read_table(path)
    if len(table.header) < 12:
        raise BadInput(f"{path.name} line 1", f"has {len(table.header)} columns, RoboDK's 12 or 18")
    values = table.complete(table.header[:12])
    joints, pose = np.radians(values[:, :6]), values[:, 6:]
    measured = np.asarray(pose.any(axis=1))
    turned = pose[:, 3:].any(axis=1)
    position = np.where(measured[:, None], pose[:, :3] * 1e-3, np.nan)
    orientation = np.full((len(pose), 4), np.nan)
    if turned.any():
        order = check_order(options.euler, _WHY)
        angles = np.radians(pose[turned, 3:])
        R = np.array([rotation_from_angles(row, order) for row in angles])
        orientation[turned] = quaternion_from_rotation(R)
    notes = (f"{int(measured.sum())} of {len(pose)} rows measured, {int(turned.sum())} full poses",)
    return MeasuredTable(joints, position, orientation, notes=notes)


def _check_robot(robot: Robot) -> None:
    if robot.n_joints != 6 or robot.geometry.prismatic.any():
        raise BadInput("format robodk", "holds six revolute joints and nothing else")


def robodk_export(calibrated: CalibratedRobot, options: ExportOptions) -> Export:
    """Poses of the calibrated robot at 1,000 joint readings, as if measured without noise.

    RoboDK takes no foreign kinematic model; its own calibration finds the model from these rows.

    Raises
    ------
    BadInput
        If the robot has not six revolute joints, or the order of angles is not given.
    """
    robot = calibrated.robot
    _check_robot(robot)
    order = check_order(options.euler, _WHY)
    q = random_joints(robot.limits)
    T = calibrated.tool_poses(q)
    tool = invert(robot.geometry.flange) @ calibrated.model.tool_frame
    tools = np.repeat(tool[None], len(q), axis=0)
    values = np.hstack([np.degrees(q), _xyz_angles(T, order), _xyz_angles(tools, order)])
    lines = [",".join(_HEADER), *(",".join(map(repr, row)) for row in values.tolist())]

    def difference(path: Path) -> Difference:
        read = read_robodk(path, robot, MeasurementOptions(euler=options.euler))
        found = np.zeros_like(T)
        found[:, :3, :3] = rotation_from_quaternion(read.orientation)
        found[:, :3, 3] = read.position
        found[:, 3, 3] = 1.0
        return pose_difference(calibrated.tool_poses(read.joints), found)

    left_out = (
        f"a RoboDK table holds {len(q)} poses in the measuring frame, no kinematic parameters, "
        "covariance or joint limits",
    )
    return Export("\n".join(lines) + "\n", left_out, difference)


def _xyz_angles(T: Float[Array, "row 4 4"], order: str) -> Float[Array, "row 6"]:
    """x, y, z [mm] and angles about x, y, z [deg]."""
    angles = [angles_from_rotation(R, order) for R in T[:, :3, :3]]
    return np.hstack([T[:, :3, 3] * 1e3, np.degrees(angles)])
