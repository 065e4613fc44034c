"""Compensation where more than geometry acts: the pose asked of the geometry leaves room for it.

What the effects shift at the joints found so far is taken off the wanted pose, and the geometry is
asked again. An effect shifts by a thousandth of what the joints move, so a few rounds do.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.compensation import Compensation, compensate, find_nominal_joints
from robocal.diagnosis.extended import predict
from robocal.errors import BadInput
from robocal.frames import invert, rotation_vector
from robocal.measurements import MeasurementSet

_ROUNDS = 8
_STANDSTILL = 1e-9
"""Error of position [m] and angle [rad] at which the rounds end."""


def compensate_effects(
    calibrated: CalibratedRobot,
    wanted: Float[Array, "pose 4 4"],
    rows: MeasurementSet,
    nominal_q: Float[Array, "pose joint"] | None,
) -> Compensation:
    """Joints for tool poses in the measuring frame, with all effects of the model acting.

    Parameters
    ----------
    calibrated
        Model with effects.
    wanted
        Target poses.
    rows
        What is known of the moment: payload, temperature, approach; row for row.
    nominal_q
        Joints that the nominal robot would use, which decide the configuration; found if None.

    Raises
    ------
    BadInput
        If an effect depends on a column that the rows lack.
    """
    model, limits = calibrated.model, calibrated.robot.limits
    if nominal_q is None:
        nominal = replace(
            calibrated.robot.geometry, station=model.base_frame, flange=model.tool_frame
        )
        nominal_q = find_nominal_joints(nominal, wanted, limits)
    asked, start = wanted, nominal_q
    for _ in range(_ROUNDS):
        found = compensate(model, asked, start, limits)
        there = acting_poses(calibrated, replace(rows, joints=found.q))
        miss = invert(there) @ wanted
        shift = np.linalg.norm(miss[:, :3, 3], axis=1)
        turn = np.linalg.norm(rotation_vector(miss[:, :3, :3]), axis=1)
        if (np.maximum(shift, turn) < _STANDSTILL).all():
            break
        asked = calibrated.tool_poses(found.q) @ miss
        start = found.q
    return replace(found, position_error=shift, angle_error=turn)


def acting_poses(calibrated: CalibratedRobot, rows: MeasurementSet) -> Float[Array, "pose 4 4"]:
    """Target poses from now on: what stepped has stepped, what drifted stays where it ended.

    Raises
    ------
    BadInput
        If an effect depends on a column that the rows lack.
    """
    T = calibrated.tool_poses(rows.joints)
    around = calibrated.circumstances_of(replace(rows, position=T[:, :3, 3]))
    reference = calibrated.reference
    time = around.time if around.timed else np.full(len(rows), reference.time_end)
    latest = np.full(len(rows), np.iinfo(np.int64).max)
    target = predict(calibrated.model, replace(around, time=time, lines=latest), calibrated.effects)
    for position, axis in enumerate((target.x, target.y, target.z, target.p)):
        T[:, :3, position] = axis.T
    if not np.isfinite(T).all():
        row = int(np.argmax(~np.isfinite(T).all(axis=(1, 2))))
        names = ", ".join(fitted.instance.title for fitted in calibrated.effects)
        raise BadInput(
            f"line {rows.lines[row]}", f"lacks a column that the model's effects need ({names})"
        )
    return T
