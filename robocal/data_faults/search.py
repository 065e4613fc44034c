"""Find the slips of a bundle: joints, units, mirror, rows, orientations, in this order."""

import numpy as np

from robocal.data_faults.campaign_view import (
    LEAST_POSES,
    View,
    file_order,
    on_main_target,
    view_of,
)
from robocal.data_faults.hypotheses import (
    CERTAINLY_CLEAN,
    Candidate,
    Explanation,
    chain_length,
    explain,
    plausible_error,
    unseen,
    with_rivals,
)
from robocal.data_faults.joints import AS_WRITTEN, paired_joint_slips, single_joint_slips
from robocal.data_faults.misfit import (
    fit_as_written,
    predicted_by,
    refuse_misfit,
    refuse_missed_lengths,
    row_tolerance,
)
from robocal.data_faults.rows import SHIFTS, find_row_slips, partners
from robocal.data_faults.slip import Slip, mend, mend_whichever
from robocal.data_faults.tool_rotation import fit_orientations, misfit_as_written
from robocal.errors import BadInput, NoAnswer
from robocal.formats.bundle import Bundle
from robocal.progress import tell
from robocal.robots.robot import Robot

_SAME_JOINTS = 4
"""Decimals of joint readings that tell poses apart [rad or m]; [1]"""
_LEAST_POSES = 5
_DOUBTFUL_ANGLE = 0.15
"""Orientations that miss by more are not those of this target [rad]"""
_SHORTEST_ROBOT = 0.03
"""Sum of link lengths below which they are taken for metres; ten metres would read 10 mm [m]"""
_UNEXPLAINED = (
    "and no slip of unit, sign, zero, column or row order, mirror or pair of these explains it"
)


def find_slips(bundle: Bundle) -> tuple[Slip, ...]:
    """Slips of convention, unit and row order, each with its mend; empty for sound data.

    Rows are tried against the nominal robot with free base, tool and nests. Too few poses to tell
    one slip from another, or lengths alone, get no name, but are refused if they miss by far.

    Raises
    ------
    BadInput
        If the points stay the same while the joints move, or the robot has no length to speak of.
    NoAnswer
        If the data do not fit this robot, and no slip that is known explains it.

    References
    ----------
    .. [1] docs/data_faults.md lists what is tried and how surely it is named.
    """
    _refuse_robot_in_metres(bundle.robot)
    _refuse_stuck_points(bundle)
    slips = _slips_of_points(bundle)
    refuse_missed_lengths(mend_whichever(bundle, slips))
    return slips


def _slips_of_points(bundle: Bundle) -> tuple[Slip, ...]:
    """Slips under which the nominal robot fits the points of its targets."""
    view, written = view_of(bundle), fit_as_written(bundle)
    if view is None or written is None:
        return ()
    tell("slips of convention")
    if not view.tells_slips:
        refuse_misfit(bundle, written.fit, "and too few poses are there to tell why")
        return ()
    explanations = _explain_points(bundle, view, written)
    row_slips = _row_slips(bundle, explanations[0])
    ways = _explain_poses(mend(bundle, row_slips), explanations)
    slips = (*row_slips, *with_rivals(ways))
    mended = mend_whichever(bundle, slips)
    last = fit_as_written(mended) if slips else written
    if last is not None:
        refuse_misfit(mended, last.fit, _UNEXPLAINED)
    return slips


def _refuse_robot_in_metres(robot: Robot) -> None:
    """Complain about a nominal arm that is too short before the measurements are blamed for it."""
    length = chain_length(robot)
    if 0.0 < length < _SHORTEST_ROBOT:
        raise BadInput(
            "robot.yaml",
            f"all links of robot '{robot.name}' together are {length * 1e3:.3g} mm long, so its "
            "lengths (d_mm, a_mm) look like metres: multiply them by 1000",
        )


def _refuse_stuck_points(bundle: Bundle) -> None:
    """Complain where one point stands beside many joints: such points fit an arm without length."""
    view = view_of(bundle)
    if view is None:
        return
    joints = np.round(bundle.measurements.joints[view.moved], _SAME_JOINTS)
    poses = len(np.unique(np.column_stack([joints, view.places]), axis=0))
    points = len(np.unique(view.points, axis=0))
    if poses >= LEAST_POSES and 2 * points < poses:
        raise BadInput(
            "measurements.csv",
            f"has only {points} point{'s' * (points > 1)} at {poses} different poses, the same to "
            "the last digit: the instrument did not read anew, or x_mm, y_mm, z_mm are not its",
        )


def _explain_points(bundle: Bundle, view: View, written: Explanation) -> tuple[Explanation, ...]:
    """What makes the points fit: nothing, one slip, slipped rows, or several slips."""
    plausible = plausible_error(bundle.robot)
    score, misfit = written.fit.score, written.misfit
    if score <= CERTAINLY_CLEAN * plausible:
        return (written,)
    singles = (AS_WRITTEN, *single_joint_slips(bundle.robot, bundle.measurements))
    pairs = paired_joint_slips(bundle.robot)
    found = explain([Candidate(view, joints) for joints in singles], misfit)
    if found and len(found[0].slips) > 1:
        # A joint and a mirror or a unit: two joints may do as well.
        found = explain([Candidate(view, joints) for joints in (*singles, *pairs)], misfit)
    if found:
        return found
    if score <= plausible:
        return (written,)
    halves = _shifted_halves(bundle, view)
    for candidates in (
        [Candidate(half, AS_WRITTEN) for half in halves],
        [Candidate(half, joints) for half in halves for joints in singles],
        [Candidate(view, joints) for joints in pairs],
    ):
        found = explain(candidates, misfit)
        if found:
            return found
    return (written,)


def _shifted_halves(bundle: Bundle, view: View) -> list[View]:
    """Both halves of the file, beside the joints of up to five rows before or after."""
    order = file_order(bundle)
    halves = []
    for shift in sorted(SHIFTS, key=abs):
        source = partners(order, np.full(len(order), shift))
        halves += [half.shifted(source) for half in view.halves()]
    return halves


def _row_slips(bundle: Bundle, explanation: Explanation) -> tuple[Slip, ...]:
    """Shifted and exchanged rows, if the robot fits once they and the columns are mended."""
    found = _misplaced_rows(bundle, explanation)
    if not found:
        return ()
    # Rows that are exchanged as well show only once the others stand where they belong.
    found += _misplaced_rows(mend(bundle, found), explanation)
    fitted = fit_as_written(mend_whichever(bundle, (*found, *explanation.slips)))
    explained = fitted is not None and fitted.fit.score <= plausible_error(bundle.robot)
    return found if explained else ()


def _misplaced_rows(bundle: Bundle, explanation: Explanation) -> tuple[Slip, ...]:
    """Shifted and exchanged rows, once the columns are read as `explanation` says."""
    rows = bundle.measurements
    for slip in explanation.slips:
        rows = slip.mend(rows)
    points = predicted_by(bundle, rows, explanation.fit)
    tolerance = row_tolerance(bundle, explanation.fit)
    return find_row_slips(file_order(bundle), rows.lines, points.seen, points.distance, tolerance)


def _explain_poses(
    bundle: Bundle, explanations: tuple[Explanation, ...]
) -> tuple[tuple[Slip, ...], ...]:
    """The slips of the points, completed by those of the orientations; rows stand in order."""
    rows = bundle.measurements
    chosen = np.flatnonzero(on_main_target(bundle) & rows.has_orientation)
    if len(chosen) < _LEAST_POSES:
        return tuple(one.slips for one in explanations)
    found = fit_orientations(explanations, rows, chosen)
    if found:
        return tuple(one.slips for one in found)
    hidden = unseen(explanations[0], single_joint_slips(bundle.robot, rows))
    found = fit_orientations(hidden, rows, chosen) if hidden else ()
    if not found:
        if misfit_as_written(explanations, rows, chosen) <= _DOUBTFUL_ANGLE:
            return tuple(one.slips for one in explanations)
        raise NoAnswer(
            f"measurements.csv: the positions fit robot '{bundle.robot.name}', the orientations "
            "qw, qx, qy, qz do not, in no order and direction; leave these columns out or check "
            "what they describe"
        )
    return tuple(one.slips for one in found)
