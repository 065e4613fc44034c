"""Compensation where more than geometry acts: the pose asked of the geometry leaves room for it.

What the effects shift at the joints found so far is taken off the wanted pose, and the geometry is
asked again. An effect shifts by a thousandth of what the joints move, so a few rounds do.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.compensation import Compensation, compensate_targets, judge, nominal_in_cell
from robocal.frames import invert, rotation_vector
from robocal.measurements import MeasurementSet
from robocal.nominal_joints import find_nominal_joints
from robocal.pose_solver import met_within, solve_joints, turned_inside

_ROUNDS = 8
_STANDSTILL = 1e-9
"""Error of position [m] and angle [rad] at which the rounds end."""


def compensate_robot(
    calibrated: CalibratedRobot,
    wanted: Float[Array, "pose 4 4"],
    rows: MeasurementSet,
    nominal_q: Float[Array, "pose joint"] | None,
    *,
    in_base: bool,
) -> Compensation:
    """Joints for poses of the tool, or of the nest that a row names, with all the model holds.

    Parameters
    ----------
    in_base
        True where `wanted` stands in the robot base instead of the measuring frame.

    Others and raises as `compensate_effects`; raises for an unknown nest too.
    """
    parts = []
    for name, chosen in calibrated.rows_by_target(rows).items():
        there = replace(calibrated, model=calibrated.model_at(name))
        start = None if nominal_q is None else nominal_q[chosen]
        if calibrated.effects:
            in_cell = calibrated.model.base_frame @ wanted if in_base else wanted
            found = compensate_effects(there, in_cell[chosen], rows.rows(chosen), start)
        else:
            found = compensate_targets(there, wanted[chosen], start, in_base=in_base)
        parts.append((np.flatnonzero(chosen), found))
    return _in_file_order(parts)


def _in_file_order(parts: list[tuple[Int[Array, "some"], Compensation]]) -> Compensation:
    """One answer of those for the rows of each nest."""
    order = np.argsort(np.concatenate([rows for rows, _ in parts]))
    reach = [status for _, found in parts for status in found.reach]
    return Compensation(
        np.concatenate([found.q for _, found in parts])[order],
        tuple(reach[row] for row in order.tolist()),
        np.concatenate([found.position_error for _, found in parts])[order],
        np.concatenate([found.angle_error for _, found in parts])[order],
    )


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
        What is known of the moment: time, payload, temperature, approach; row for row.
    nominal_q
        Joints that the nominal robot would use, which decide the configuration; found if None.

    Raises
    ------
    BadInput
        If an effect depends on a column that the rows lack.
    """
    model, limits = calibrated.model, calibrated.robot.limits
    if nominal_q is None:
        nominal_q = find_nominal_joints(nominal_in_cell(calibrated), wanted, limits)
    asked, start = wanted, nominal_q
    for _ in range(_ROUNDS):
        found = solve_joints(model, asked, start)
        # An effect may count the joint's turns, so they are settled before it is asked.
        start = turned_inside(found.q, limits, model)
        there = calibrated.poses_of(replace(rows, joints=start))
        miss = invert(there) @ wanted
        shift = np.linalg.norm(miss[:, :3, 3], axis=1)
        turn = np.linalg.norm(rotation_vector(miss[:, :3, :3]), axis=1)
        if (np.maximum(shift, turn) < _STANDSTILL).all():
            break
        asked = calibrated.tool_poses(start) @ miss
    met = found.met & met_within(shift, turn, model.n_joints)
    solution = replace(found, q=start, met=met, position_error=shift, angle_error=turn)
    return judge(model, solution, nominal_q, limits)
