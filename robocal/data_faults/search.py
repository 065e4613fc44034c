"""Find the slips of a bundle: joints, units, mirror, rows, orientations, in this order."""

import numpy as np

from robocal.data_faults.campaign_view import LEAST_ROWS, View, file_order, on_main_target, view_of
from robocal.data_faults.hypotheses import (
    CERTAINLY_CLEAN,
    Candidate,
    Explanation,
    as_written,
    explain,
    plausible_error,
    unseen,
    with_rivals,
)
from robocal.data_faults.joints import AS_WRITTEN, paired_joint_slips, single_joint_slips
from robocal.data_faults.predicted_points import predict_points
from robocal.data_faults.rows import SHIFTS, find_row_slips, partners
from robocal.data_faults.slip import Slip, mend
from robocal.data_faults.tool_rotation import fit_orientations, misfit_as_written
from robocal.errors import BadInput, NoAnswer
from robocal.formats.bundle import Bundle
from robocal.progress import tell

_ROWS = 200
_SAME_JOINTS = 4
"""Decimals of joint readings that tell poses apart [rad or m]; [1]"""
_LEAST_POSES = 5
_DOUBTFUL_ANGLE = 0.15
"""Orientations that miss by more are not those of this target [rad]"""
_NO_FIT = 2.5
"""Times the plausible error above which the robot is not this one"""


def find_slips(bundle: Bundle) -> tuple[Slip, ...]:
    """Slips of convention, unit and row order, each with its mend; empty for sound data.

    Rows are tried against the nominal robot with free base and tool. Fewer than 15 points of one
    target, or lengths alone, show nothing: the answer is empty too.

    Raises
    ------
    BadInput
        If the points stay the same while the joints move.
    NoAnswer
        If the data do not fit this robot, and no slip that is known explains it.

    References
    ----------
    .. [1] docs/data_faults.md lists what is tried and how surely it is named.
    """
    _refuse_stuck_points(bundle)
    view = view_of(bundle)
    if view is None:
        return ()
    tell("slips of convention")
    written = as_written(view.evenly(_ROWS))
    explanations = _explain_points(bundle, view, written)
    row_slips = _row_slips(bundle, explanations[0])
    in_order = mend(bundle, row_slips)
    if row_slips:
        # Rows that are exchanged as well show only once the others stand where they belong.
        row_slips += _row_slips(in_order, explanations[0])
        in_order = mend(bundle, row_slips)
    ways = _explain_poses(in_order, explanations)
    return (*row_slips, *with_rivals(ways))


def _refuse_stuck_points(bundle: Bundle) -> None:
    """Complain where one point stands beside many joints: such points fit an arm without length."""
    rows = bundle.measurements
    chosen = on_main_target(bundle) & np.isfinite(rows.position).all(axis=1)
    poses = len(np.unique(np.round(rows.joints[chosen], _SAME_JOINTS), axis=0))
    points = len(np.unique(rows.position[chosen], axis=0))
    if poses >= LEAST_ROWS and 2 * points < poses:
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
    if score <= _NO_FIT * plausible:
        return (written,)
    raise NoAnswer(
        f"measurements.csv: the data do not fit robot '{bundle.robot.name}': with base and tool "
        f"fitted freely its points are missed by {score * 1e3:.0f} mm, and no slip of unit, sign, "
        "zero, column or row order, mirror or pair of these explains it; check robot.yaml and what "
        "was measured"
    )


def _shifted_halves(bundle: Bundle, view: View) -> list[View]:
    """Both halves of the file, beside the joints of up to five rows before or after."""
    order = file_order(bundle)
    halves = []
    for shift in sorted(SHIFTS, key=abs):
        source = partners(order, np.full(len(order), shift))
        halves += [half.shifted(source) for half in view.halves()]
    return halves


def _row_slips(bundle: Bundle, explanation: Explanation) -> tuple[Slip, ...]:
    """Shifted and exchanged rows, once the columns are read as `explanation` says."""
    rows = bundle.measurements
    for slip in explanation.slips:
        rows = slip.mend(rows)
    points = predict_points(bundle, rows, on_main_target(bundle), explanation.fit)
    tolerance = max(6.0 * explanation.fit.score, 0.25 * plausible_error(bundle.robot))
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
