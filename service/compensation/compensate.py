"""Joints that bring the calibrated robot of a cell to wanted poses, within its limits."""

import json
from dataclasses import replace
from functools import lru_cache
from threading import Lock
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import UNKNOWN_BASE_ROTATION, UNKNOWN_ROTATION, CalibratedRobot
from robocal.compensated_effects import compensate_robot
from robocal.compensation import Compensation, asked_for
from robocal.errors import BadInput
from robocal.formats.measurements_csv import joint_columns
from robocal.formats.model_yaml import model_from_document
from robocal.frames import rotation_from_quaternion
from robocal.measurements import unmeasured_rows
from robocal.orientation_of import OrientationOf
from robocal.reach import Reach
from robocal.robots.robot import Robot
from service.campaigns.models import JointColumns
from service.cells.bounds import narrowed
from service.cells.models import NewCell
from service.compensation.models import (
    CompensatedJoints,
    CompensationRequest,
    Frame,
    MissedPose,
    WantedPose,
)
from service.errors import Unusable

_UNIT_WITHIN = 1e-2
"""A quaternion whose length is further from one is a slip; [1]"""
_WORDS = {
    Reach.outside_limits: "the joints that reach it are outside the joint limits",
    Reach.singular: "the arm is singular there; choose a pose a little away from it",
    Reach.other_configuration: "the joints that reach it put shoulder, elbow or wrist on the other "
    "side than the nominal ones",
    Reach.not_reached: "the calibrated robot does not reach it",
}
_one_at_a_time = Lock()
"""Two batches at once would take longer than one after the other, and hold up every other call."""


def compensate_poses(
    cell: NewCell, version: int, model: dict[str, Any], request: CompensationRequest
) -> CompensatedJoints:
    """Joints for the poses of a request, within the limits of robot and cell.

    Raises
    ------
    Unusable
        Naming the pose whose quaternion or joints are none, or what the model needs to know;
        if the parameters do not know the frame or the orientation that the poses state.
    """
    calibrated = _calibrated(json.dumps(model, sort_keys=True))
    calibrated = replace(calibrated, robot=narrowed(calibrated.robot, cell.limits))
    calibrated, orientation_of = asked_for(calibrated, request.orientation_of)
    if orientation_of is OrientationOf.tool and not calibrated.tool_rotation_known:
        raise Unusable(
            f"body poses: state orientations of the tool, but {UNKNOWN_ROTATION}; state those of "
            'the flange with "orientation_of": "flange", or calibrate with full poses.'
        )
    if request.frame is Frame.cell and not calibrated.base_rotation_known:
        raise Unusable(
            f"body poses: stand in the frame of the cell, but {UNKNOWN_BASE_ROTATION}; give them "
            'in the robot base with "frame": "base", or calibrate with positions.'
        )
    wanted = _wanted_frames(request.poses)
    nominal_q = _nominal_joints(calibrated.robot, request.poses)
    with _one_at_a_time:
        found = _compensate(calibrated, wanted, nominal_q, request)
    return _answer(cell.name, version, orientation_of, calibrated.robot, found)


@lru_cache(maxsize=32)
def _calibrated(model: str) -> CalibratedRobot:
    return model_from_document(json.loads(model))


def _wanted_frames(poses: list[WantedPose]) -> Float[Array, "pose 4 4"]:
    quaternions = np.array([pose.quaternion for pose in poses])
    length = np.linalg.norm(quaternions, axis=1)
    off = np.abs(length - 1.0) > _UNIT_WITHIN
    if off.any():
        number = int(np.argmax(off))
        raise Unusable(
            f"body poses.{number}.quaternion: has length {length[number]:.4g}, must be 1."
        )
    T = np.zeros((len(poses), 4, 4))
    T[:, :3, :3] = rotation_from_quaternion(quaternions)
    T[:, :3, 3] = np.array([pose.xyz_mm for pose in poses]) * 1e-3
    T[:, 3, 3] = 1.0
    return T


def _nominal_joints(robot: Robot, poses: list[WantedPose]) -> Float[Array, "pose joint"] | None:
    """Nominal joints of all poses; None where none has them."""
    columns = joint_columns(robot)
    given = [pose.nominal_joints for pose in poses]
    if all(joints is None for joints in given):
        return None
    rows = [_row(number, joints, columns) for number, joints in enumerate(given)]
    return np.asarray(np.array(rows) * robot.joint_scale)


def _row(number: int, joints: JointColumns | None, columns: tuple[str, ...]) -> list[float]:
    if joints is None or set(joints) != set(columns):
        raise Unusable(
            f"body poses.{number}.nominal_joints: must name {', '.join(columns)}; "
            "give them for every pose or for none."
        )
    return [joints[column] for column in columns]


def _compensate(
    calibrated: CalibratedRobot,
    wanted: Float[Array, "pose 4 4"],
    nominal_q: Float[Array, "pose joint"] | None,
    request: CompensationRequest,
) -> Compensation:
    unknown = float("nan")
    rows = unmeasured_rows(
        np.zeros((len(wanted), calibrated.robot.n_joints)),
        unknown if request.payload_kg is None else request.payload_kg,
        unknown if request.temperature_degc is None else request.temperature_degc,
    )
    in_base = request.frame is Frame.base
    try:
        return compensate_robot(calibrated, wanted, rows, nominal_q, in_base=in_base)
    except BadInput as error:
        raise Unusable(
            f"body: the model's effects need more than the poses ({error.reason}); "
            "give temperature_degc and payload_kg, or use parameters without these effects."
        ) from error


def _answer(
    cell: str, version: int, orientation_of: OrientationOf, robot: Robot, found: Compensation
) -> CompensatedJoints:
    rows: list[list[float] | None] = list((found.q / robot.joint_scale).round(9).tolist())
    missed = []
    for number, reach in enumerate(found.reach):
        if reach is not Reach.reached:
            rows[number] = None
            missed.append(
                MissedPose(pose=number, status=reach, detail=f"Pose {number}: {_WORDS[reach]}.")
            )
    all_turn = set(robot.joint_units) == {"deg"}
    return CompensatedJoints(
        cell=cell,
        version=version,
        orientation_of=orientation_of,
        columns=list(joint_columns(robot)),
        joints_deg=rows if all_turn else None,
        joints=None if all_turn else rows,
        reached=len(rows) - len(missed),
        missed=missed,
    )
