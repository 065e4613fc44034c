"""Rows that causes can be judged by: in the order of time, and no cell empty that others have."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.bundle import Bundle, RejectedRow
from robocal.measurements import MeasurementSet

_RECORDED = 0.5
"""A column that fewer rows than this have counts as not recorded: nothing is judged by it; [1]"""


@dataclass(frozen=True)
class Judgeable:
    """A bundle without the rows that causes cannot be judged by."""

    bundle: Bundle
    unrecorded: tuple[str, ...]
    """Columns that too few rows have to judge by, for people."""


def judgeable(bundle: Bundle) -> Judgeable:
    """Leave out rows that lack a time, temperature or payload which most others have.

    One empty cell would otherwise hide every effect of its column, and another one that resembles
    it would be named instead.

    Raises
    ------
    BadInput
        If the rows are not in the order of their times, by which moves, steps and drifts are
        judged; or if no row says all that most say.
    """
    measured, unrecorded = bundle.measurements, []
    fixed = {name for name, target in bundle.targets.items() if target.fixed}
    of_robot = np.array([name not in fixed for name in measured.target], dtype=bool)
    reasons: dict[int, str] = {}
    for name, values, needed in (
        ("t_s", measured.time, np.ones_like(of_robot)),
        # Nests beside the robot know neither.
        ("temperature_degc", measured.temperature, of_robot),
        ("payload_kg", measured.payload, of_robot),
    ):
        stated, lacking = np.isfinite(values) & needed, ~np.isfinite(values) & needed
        if not stated.any() or not lacking.any():
            continue
        if stated.sum() < _RECORDED * needed.sum():
            unrecorded.append(f"{name}: only {stated.sum()} of {needed.sum()} rows have it")
            continue
        for line in measured.lines[lacking].tolist():
            reasons.setdefault(line, f"{name} is empty, which most rows have")
    kept: Bool[Array, "row"] = ~np.isin(measured.lines, list(reasons))
    if reasons and not (kept & ~measured.held_out & of_robot).any():
        raise BadInput(
            "measurements.csv",
            "has no row to fit with all of t_s, temperature_degc and payload_kg that most rows "
            "have; fill these columns, or empty them",
        )
    measured = measured.rows(kept)
    _refuse_disorder(measured)
    rejected = (*bundle.rejected, *(RejectedRow(*item) for item in sorted(reasons.items())))
    return Judgeable(replace(bundle, measurements=measured, rejected=rejected), tuple(unrecorded))


def _refuse_disorder(measured: MeasurementSet) -> None:
    earlier = np.diff(measured.time) < 0
    if earlier.any():
        row = int(np.argmax(earlier))
        raise BadInput(
            f"measurements.csv line {measured.lines[row + 1]}",
            f"t_s lies before that of line {measured.lines[row]}; causes are judged by the order "
            "in which rows were measured: sort the file by t_s, or empty the column if the clock "
            "was set back",
        )
