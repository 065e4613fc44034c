"""Joints that bring the calibrated robot to a wanted pose, and what is to be said of each target.

The calibrated robot is asked by least squares from the joints that the nominal one would use. A
joint that ends beyond its limit is brought inside by full turns where the limits allow it.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.frames import invert
from robocal.kinematics.model import KinematicModel
from robocal.nominal_joints import find_nominal_joints
from robocal.orientation_of import OrientationOf
from robocal.pose_solver import (
    Solution,
    configurations,
    dexterities,
    inside_limits,
    solve_joints,
    turned_inside,
)
from robocal.reach import Reach

_SINGULAR = 1e-3
"""Smallest singular value of the Jacobian, turns counted at `pose_solver.LEVER`, at which a pose
counts as singular: a joint turns by 1 mrad for each micrometre of the pose [m/rad]"""
_NEAR = 5e-3
"""Error at the end of a failed iteration up to which the singular pose where it ended is to blame,
not the arm's length; the size of a geometry error [m, rad]"""


@dataclass(frozen=True)
class Compensation:
    """Joints for every wanted pose."""

    q: Float[Array, "pose joint"]
    """[rad or m]; the last iterate where the pose was not reached."""
    reach: tuple[Reach, ...]
    position_error: Float[Array, "pose"]
    """What the model still misses [m]."""
    angle_error: Float[Array, "pose"]
    """[rad]"""


def compensate_targets(
    calibrated: CalibratedRobot,
    wanted: Float[Array, "pose 4 4"],
    nominal_q: Float[Array, "pose joint"] | None,
    *,
    in_base: bool,
) -> Compensation:
    """Joints for tool poses, in the measuring frame or in the robot base, by geometry alone.

    Parameters
    ----------
    wanted
        Target poses.
    nominal_q
        Joints that the nominal robot would use, which decide the configuration [rad or m]. None:
        they are found, in one configuration for all where the arm allows it.
    in_base
        True where `wanted` stands in the robot base instead of the measuring frame.
    """
    model, nominal = calibrated.model, nominal_in_cell(calibrated)
    if in_base:
        model, nominal = without_base(model), without_base(nominal)
    limits = calibrated.robot.limits
    if nominal_q is None:
        nominal_q = find_nominal_joints(nominal, wanted, limits)
    return compensate(model, wanted, nominal_q, limits)


def nominal_in_cell(calibrated: CalibratedRobot) -> KinematicModel:
    """The nominal links in the identified base, with the identified tool."""
    model = calibrated.model
    return replace(calibrated.robot.geometry, station=model.base_frame, flange=model.tool_frame)


def turned_as_flange(calibrated: CalibratedRobot) -> CalibratedRobot:
    """The same robot with its target where it is, but with the flange's axes.

    A wanted orientation is then the flange's, which any identification knows. The covariance still
    speaks of the tool's own axes.
    """
    flange = calibrated.robot.geometry.flange
    place = np.eye(4)
    place[:3, 3] = (invert(flange) @ calibrated.model.tool_frame)[:3, 3]
    model = replace(calibrated.model, flange=flange @ place, tool=np.zeros(6))
    return replace(calibrated, model=model, tool_rotation_known=True)


def asked_for(
    calibrated: CalibratedRobot, orientation_of: OrientationOf | None
) -> tuple[CalibratedRobot, OrientationOf]:
    """The robot with the axes whose orientation is asked for, and whose these are.

    Of the tool unless asked otherwise, or of the flange where the tool's rotation is not known.
    """
    if orientation_of is None:
        known = calibrated.tool_rotation_known
        orientation_of = OrientationOf.tool if known else OrientationOf.flange
    flange = orientation_of is OrientationOf.flange
    return (turned_as_flange(calibrated) if flange else calibrated), orientation_of


def without_base(model: KinematicModel) -> KinematicModel:
    """The same robot and tool, seen from its own base."""
    return replace(model, station=np.eye(4), base=np.zeros(6))


def compensate(
    model: KinematicModel,
    wanted: Float[Array, "pose 4 4"],
    nominal_q: Float[Array, "pose joint"],
    limits: Float[Array, "joint 2"],
) -> Compensation:
    """Joint readings at which `model` puts its target at the wanted poses.

    Parameters
    ----------
    model
        Calibrated geometry with its frames.
    wanted
        Target poses in the measuring frame.
    nominal_q
        Where to start, which decides the configuration (elbow, wrist) [rad or m].
    limits
        Lower and upper joint readings; a solution outside is turned inside or named, not clipped.
    """
    solution = solve_joints(model, wanted, nominal_q)
    inside = replace(solution, q=turned_inside(solution.q, limits, model))
    return judge(model, inside, nominal_q, limits)


def judge(
    model: KinematicModel,
    solution: Solution,
    nominal_q: Float[Array, "pose joint"],
    limits: Float[Array, "joint 2"],
) -> Compensation:
    """What is to be said of joints that were found from the nominal ones."""
    kept = configurations(model, nominal_q) == configurations(model, solution.q)
    near = np.maximum(solution.position_error, solution.angle_error) < _NEAR
    dexterity = np.minimum(dexterities(model, nominal_q), dexterities(model, solution.q))
    singular = near & ((dexterity < _SINGULAR) | ~solution.met)
    # numpy.full would turn the members into plain text.
    reach = np.empty(len(nominal_q), dtype=object)
    reach[:] = Reach.reached
    reach[~inside_limits(solution.q, limits)] = Reach.outside_limits
    reach[~kept] = Reach.other_configuration
    reach[~solution.met] = Reach.not_reached
    reach[singular] = Reach.singular
    return Compensation(
        solution.q, tuple(reach.tolist()), solution.position_error, solution.angle_error
    )
