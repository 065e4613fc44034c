"""How far the nominal robot misses the points, and where that is too far to go on."""

import numpy as np

from robocal.data_faults.campaign_view import file_order, on_tool, targets_on_tool, view_of
from robocal.data_faults.frame_fits import QUANTILE, RigidFit
from robocal.data_faults.hypotheses import Explanation, as_written, plausible_error
from robocal.data_faults.length_misfit import LEAST_LENGTHS, missed_lengths
from robocal.data_faults.predicted_points import PredictedPoints, predict_points
from robocal.errors import NoAnswer
from robocal.formats.bundle import Bundle
from robocal.measurements import MeasurementSet

_ROWS = 200
_NO_FIT = 2.5
"""Times the plausible error above which the robot is not this one"""
_LEAST_OF_A_TARGET = 4


def fit_as_written(bundle: Bundle) -> Explanation | None:
    """The best fit of the rows as they stand; None where no point of the tool is measured."""
    view = view_of(bundle)
    return None if view is None else as_written(view.evenly(_ROWS))


def row_tolerance(bundle: Bundle, fit: RigidFit) -> float:
    """Distance that a row at its place may have from its point [m]."""
    return max(6.0 * fit.score, 0.25 * plausible_error(bundle.robot))


def predicted_by(bundle: Bundle, rows: MeasurementSet, fit: RigidFit) -> PredictedPoints:
    """Points of all rows of a bundle, once their columns are mended."""
    return predict_points(bundle, rows, file_order(bundle), fit, row_tolerance(bundle, fit))


def refuse_misfit(bundle: Bundle, fit: RigidFit, why: str) -> None:
    """Complain where the nominal robot misses the points, or those of one target, by far.

    Parameters
    ----------
    bundle
        As it is going to be fitted.
    fit
        Its own.
    why
        What the complaint says of the cause.

    Raises
    ------
    NoAnswer
        If most points, or half of those of one target, are off by 5 % of the robot's length.
    """
    view = view_of(bundle)
    if view is None or not view.can_miss:
        return
    points = predicted_by(bundle, bundle.measurements, fit)
    every = np.arange(len(bundle.measurements))
    missed = points.distance(every, every)
    # The lower of two points, for one bad point of a few decides nothing.
    worst = float(np.quantile(missed[points.seen], QUANTILE, method="lower"))
    names = np.array(bundle.measurements.target)
    for name in targets_on_tool(bundle):
        own = missed[points.seen & (names == name)]
        if len(own) >= _LEAST_OF_A_TARGET:
            worst = max(worst, float(np.median(own)))
    if worst > _NO_FIT * plausible_error(bundle.robot):
        raise NoAnswer(
            f"measurements.csv: the data do not fit robot '{bundle.robot.name}': with base, tool "
            f"and nests fitted freely its points are missed by {worst * 1e3:.0f} mm, {why}; check "
            "robot.yaml and what was measured"
        )


def refuse_missed_lengths(bundle: Bundle) -> None:
    """Complain where lengths to one target are missed by far, whatever anchor and target.

    Raises
    ------
    NoAnswer
        If most of them are off by 5 % of the robot's length.
    """
    rows = bundle.measurements
    usable = np.isfinite(rows.distance) & on_tool(bundle)
    names = np.array(rows.target)
    for name in sorted({*names[usable].tolist()}):
        own = usable & (names == name)
        if np.count_nonzero(own) < LEAST_LENGTHS:
            continue
        missed = missed_lengths(bundle.robot.geometry, rows.joints[own], rows.distance[own])
        worst = float(np.quantile(missed, QUANTILE, method="lower"))
        if worst > _NO_FIT * plausible_error(bundle.robot):
            raise NoAnswer(
                f"measurements.csv: the lengths do not fit robot '{bundle.robot.name}': with "
                f"anchor and target anywhere they are missed by {worst * 1e3:.0f} mm; check unit "
                "and order of distance_mm, the joints, and robot.yaml"
            )
