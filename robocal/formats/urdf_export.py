"""URDF of a calibrated robot: joints about z, and base and tool as fixed joints."""

from collections.abc import Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.formats.joint_origins import origins_of, xyz_rpy
from robocal.formats.model_export import Difference, Export, ExportOptions, model_difference
from robocal.formats.urdf import read_urdf

_LEFT_OUT = "URDF holds no covariance and no provenance"


def urdf_export(calibrated: CalibratedRobot, _: ExportOptions) -> Export:
    """Kinematics as URDF; masses, shapes and colours stay in the maker's file.

    Links are `measuring_frame`, `base_link`, `link_1` ... `link_n`, `target`.
    """
    robot = calibrated.robot

    def difference(path: Path) -> Difference:
        return model_difference(calibrated.model, read_urdf(path).geometry, robot.limits)

    return Export("\n".join(_lines(calibrated)) + "\n", (_LEFT_OUT,), difference)


def _lines(calibrated: CalibratedRobot) -> Iterator[str]:
    model, robot = calibrated.model, calibrated.robot
    chain = origins_of(model)
    joints = [f"link_{joint + 1}" for joint in range(model.n_joints)]
    yield '<?xml version="1.0"?>'
    yield f"<robot name={quoteattr(robot.name)}>"
    for link in ("measuring_frame", "base_link", *joints, "target"):
        yield f'  <link name="{link}"/>'
    yield from _joint("base", "fixed", ("measuring_frame", "base_link"), model.base_frame)
    parent = "base_link"
    for number, (child, origin) in enumerate(zip(joints, chain.origins, strict=True), 1):
        slides = bool(model.prismatic[number - 1])
        lower, upper = (float(value) for value in robot.limits[number - 1])
        kind = "prismatic" if slides else "revolute"
        motion = (
            '    <axis xyz="0 0 1"/>',
            f'    <limit lower="{lower!r}" upper="{upper!r}" effort="0" velocity="0"/>',
        )
        yield from _joint(f"joint_{number}", kind, (parent, child), origin, motion)
        parent = child
    yield from _joint("tool", "fixed", (parent, "target"), chain.end @ model.tool_frame)
    yield "</robot>"


def _joint(
    name: str,
    kind: str,
    links: tuple[str, str],
    origin: Float[Array, "4 4"],
    motion: tuple[str, ...] = (),
) -> Iterator[str]:
    xyz, rpy = (" ".join(repr(value) for value in part) for part in xyz_rpy(np.asarray(origin)))
    yield f'  <joint name="{name}" type="{kind}">'
    yield f'    <parent link="{links[0]}"/>'
    yield f'    <child link="{links[1]}"/>'
    yield f'    <origin xyz="{xyz}" rpy="{rpy}"/>'
    yield from motion
    yield "  </joint>"
