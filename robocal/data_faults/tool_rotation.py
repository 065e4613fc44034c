"""Which reading of the orientations agrees with the positions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.data_faults.hypotheses import RIVAL, Explanation
from robocal.data_faults.mirror import (
    POSES_MIRRORED,
    POSITIONS_MIRRORED,
    Z_TURNED,
    mirrored_positions_of_poses,
)
from robocal.data_faults.orientation import orientation_misfit, orientation_slips
from robocal.data_faults.slip import Slip
from robocal.identification.frames_start import nominal_flange
from robocal.measurements import MeasurementSet

_LIMIT = 0.05
"""Angle that a nominal robot may miss its orientations by [rad]"""
_CLEAR_GAIN = 3.0
_ROWS = 120


@dataclass(frozen=True)
class TurnedExplanation:
    """Slips under which positions and orientations fit, and how well the orientations do [rad]."""

    slips: tuple[Slip, ...]
    misfit: float


def fit_orientations(
    explanations: Sequence[Explanation], rows: MeasurementSet, chosen: Int[Array, "some"]
) -> tuple[TurnedExplanation, ...]:
    """Readings that make the tool's rotation one and the same: the best, then its rivals.

    Parameters
    ----------
    explanations
        Of the positions; those that the positions cannot tell apart.
    rows
        Rows of the file, beside their own joints.
    chosen
        Those with a full pose of the target.
    """
    rows = _some(rows, chosen)
    # Badly spread points leave the base uncertain.
    limit = max(_LIMIT, 3.0 * explanations[0].misfit)
    ways = [way for one in explanations for way in _turned(one, rows, ())]
    best = min(way.misfit for way in ways)
    if best > limit:
        limit = min(limit, best / _CLEAR_GAIN)
        ways = [way for one in explanations for way in _turned(one, rows, orientation_slips())]
    found = sorted((way for way in ways if way.misfit <= limit), key=lambda way: way.misfit)
    return tuple(way for way in found if way.misfit <= RIVAL * found[0].misfit)


def misfit_as_written(
    explanations: Sequence[Explanation], rows: MeasurementSet, chosen: Int[Array, "some"]
) -> float:
    """Least angle by which the orientations miss if they are read as they stand [rad]."""
    rows = _some(rows, chosen)
    return min(way.misfit for one in explanations for way in _turned(one, rows, ()))


def _some(rows: MeasurementSet, chosen: Int[Array, "some"]) -> MeasurementSet:
    chosen = chosen[np.linspace(0, len(chosen) - 1, min(len(chosen), _ROWS)).astype(int)]
    return rows.rows(np.isin(np.arange(len(rows)), chosen))


def _turned(
    explanation: Explanation, rows: MeasurementSet, readings: tuple[Slip, ...]
) -> Iterator[TurnedExplanation]:
    """The orientations as they stand, or each of some readings of them, under every mirror."""
    joints = explanation.candidate.joints
    T = nominal_flange(explanation.candidate.view.robot.geometry, joints.joints(rows))
    for mirror, C, read in _mirrors(explanation, rows):
        flange = C.T @ T[:, :3, :3]
        slips = (*(s for s in explanation.slips if s is not POSITIONS_MIRRORED), *mirror)
        for slip in readings:
            angle = orientation_misfit(flange, slip.mend(read).orientation)
            yield TurnedExplanation((*slips, slip), angle)
        if not readings:
            yield TurnedExplanation(slips, orientation_misfit(flange, read.orientation))


def _mirrors(
    explanation: Explanation, rows: MeasurementSet
) -> Iterator[tuple[tuple[Slip, ...], Float[Array, "3 3"], MeasurementSet]]:
    """Every way of mirroring poses so that the positions fit as `explanation` says."""
    C = explanation.fit.rotation
    if not explanation.mirrored:
        yield (), C, rows
        return
    yield (POSES_MIRRORED,), C, POSES_MIRRORED.mend(rows)
    for matrix, slip in mirrored_positions_of_poses():
        yield (slip,), C @ Z_TURNED @ matrix.T, rows
