"""UR's kinematics YAML (`default_kinematics.yaml`, what `ur_calibration` writes): m and rad.

Six frames, each in the one before it, each joint turning about its frame's z; the first stands in
the controller's base, the last is the frame of wrist 3. The file's readers (URDF) take roll,
pitch, yaw as Rz Ry Rx. `ur_calibration` computes them as Rx Ry Rz, which moves the tool by up to a
few micrometres; `--euler xyz` reads such a file as it was meant.
"""

from pathlib import Path

import numpy as np

from robocal.calibrated import CalibratedRobot
from robocal.errors import BadInput
from robocal.formats.euler import check_order
from robocal.formats.fields import Fields, read_fields
from robocal.formats.joint_origins import (
    JointOrigins,
    arm_frame,
    frame_from_xyz_rpy,
    origins_of,
    revolute_geometry,
    xyz_rpy,
)
from robocal.formats.model_export import Difference, Export, ExportOptions, model_difference
from robocal.formats.robot_import import ImportedRobot, RobotOptions
from robocal.frames import invert, rotation_vector
from robocal.kinematics.model import KinematicModel
from robocal.robots.robot import Robot

_LINKS = ("shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
_ANGLES = ("roll", "pitch", "yaw")
_LIMIT = 2 * np.pi
"""Every joint of a UR turns once either way; the file does not say [rad]"""
_HASH = "calib_"


def read_ur_kinematics(path: Path, options: RobotOptions) -> ImportedRobot:
    """The robot of a UR kinematics file.

    Raises
    ------
    BadInput
        Naming line and field.
    """
    order = "zyx" if options.euler is None else check_order(options.euler, "")
    geometry, own_hash = _read(path, order)
    limits = np.array([[-_LIMIT, _LIMIT]] * len(_LINKS))
    notes = (
        f"angles were read as {'Rz Ry Rx' if order == 'zyx' else 'Rx Ry Rz'}",
        f"the robot's hash is {own_hash}; give it to `robocal export --hash`",
    )
    return ImportedRobot(Robot(options.name or path.stem, geometry, limits), notes)


def _read(path: Path, order: str) -> tuple[KinematicModel, str]:
    fields = read_fields(path)
    top = fields.mapping("kinematics")
    origins = np.array([_frame(top.mapping(link), order) for link in _LINKS])
    own_hash = top.text("hash")
    top.finish()
    fields.finish()
    return revolute_geometry(JointOrigins(origins, np.eye(4))), own_hash


def _frame(link: Fields, order: str) -> np.ndarray:
    xyz = np.array([link.number(name) for name in "xyz"])
    rpy = np.array([link.number(name) for name in _ANGLES])
    link.finish()
    return frame_from_xyz_rpy(xyz, rpy, order)


def ur_kinematics_export(calibrated: CalibratedRobot, options: ExportOptions) -> Export:
    """The identified links, with the hash that the driver compares with the controller's.

    Raises
    ------
    BadInput
        If the robot has not six revolute joints, or no hash is given.
    """
    model = calibrated.model
    if model.n_joints != len(_LINKS) or model.prismatic.any():
        raise BadInput("format ur-kinematics", "holds six revolute joints and nothing else")
    own_hash = robot_hash(options.hash)
    lines = ["kinematics:"]
    for link, origin in zip(_LINKS, origins_of(model).origins, strict=True):
        xyz, rpy = xyz_rpy(np.asarray(origin))
        lines.append(f"  {link}:")
        values = zip(("x", "y", "z", *_ANGLES), (*xyz, *rpy), strict=True)
        lines += [f"    {name}: {_yaml_number(value)}" for name, value in values]
    lines.append(f"  hash: {own_hash}")
    wrist = wrist_model(model)

    def difference(path: Path) -> Difference:
        return model_difference(wrist, _read(path, "zyx")[0], calibrated.robot.limits)

    return Export("\n".join(lines) + "\n", _left_out(calibrated), difference)


def wrist_model(model: KinematicModel) -> KinematicModel:
    """What the file can hold: from the controller's base to the frame of wrist 3."""
    return KinematicModel(
        model.links,
        model.prismatic,
        mount=model.mount,
        flange=invert(arm_frame(*model.links[-1, 2:].tolist())),
    )


def robot_hash(given: str | None) -> str:
    """The robot's own hash, as given or from its own kinematics file.

    Raises
    ------
    BadInput
        If there is none.
    """
    if given is None:
        raise BadInput(
            "option --hash",
            "is missing: give the robot's own hash (calib_...) or its kinematics file; with "
            "another one the UR driver reports a foreign calibration",
        )
    if given.endswith((".yaml", ".yml")):
        return read_fields(Path(given)).mapping("kinematics").text("hash")
    if not (given.startswith(_HASH) and given.removeprefix(_HASH).isdigit()):
        raise BadInput("option --hash", f"must be calib_ and a number or a file, not '{given}'")
    return given


def _yaml_number(value: float) -> str:
    """A number that YAML 1.1 readers take as one: 1e-05 without a point would be text."""
    text = repr(value)
    return text if "e" not in text or "." in text else text.replace("e", ".0e")


def _left_out(calibrated: CalibratedRobot) -> tuple[str, ...]:
    model = calibrated.model
    tool = arm_frame(*model.links[-1, 2:].tolist()) @ model.tool_frame
    turn = rotation_vector(tool[None, :3, :3])[0]
    x, y, z = (f"{value * 1e3:.4f}" for value in tool[:3, 3])
    rx, ry, rz = (f"{value:.7f}" for value in turn)
    turned = f"rx {rx} ry {ry} rz {rz} rad"
    if not calibrated.tool_rotation_known:
        turned = "its rotation was not identified: keep the controller's"
    bx, by, bz = (f"{value * 1e3:.4f}" for value in model.base_frame[:3, 3])
    return (
        f"UR kinematics hold no tool: set the TCP to x {x} y {y} z {z} mm, " + turned,
        f"UR kinematics hold no base in the measuring frame (origin at {bx}, {by}, {bz} mm)",
        "UR kinematics hold no joint limits, covariance or provenance",
    )
