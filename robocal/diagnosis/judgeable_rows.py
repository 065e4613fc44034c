"""Rows that causes can be judged by: in the order of time, and no cell empty that others have."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.bundle import Bundle, RejectedRow
from robocal.measurements import MeasurementSet

_RECORDED = 0.5
"""A column that fewer rows than this have counts as not recorded; [1]"""


@dataclass(frozen=True)
class Judgeable:
    """A bundle without the rows that causes cannot be judged by."""

    bundle: Bundle
    unrecorded: tuple[str, ...]
    """Columns that too few rows have, for people."""


def judgeable(bundle: Bundle) -> Judgeable:
    """Leave out rows that lack a time, temperature or payload which most others have.

    One empty cell would otherwise hide every effect of its column, and another one that resembles
    it would be named instead.

    Raises
    ------
    BadInput
        If the rows are not in the order of their times: moves, steps and drifts are judged by it.
    """
    measured, unrecorded = bundle.measurements, []
    reasons: dict[int, str] = {}
    for field, name in (
        ("time", "t_s"),
        ("temperature", "temperature_degc"),
        ("payload", "payload_kg"),
    ):
        values: Float[Array, "row"] = getattr(measured, field)
        known = np.isfinite(values)
        if known.all() or not known.any():
            continue
        if known.mean() < _RECORDED:
            unknown: dict[str, Any] = {field: np.full(len(measured), np.nan)}
            measured = replace(measured, **unknown)
            unrecorded.append(f"{name}: {known.sum()} of {len(known)} rows have it; it is not used")
            continue
        for line in measured.lines[~known].tolist():
            reasons.setdefault(line, f"{name} is empty, which most rows have")
    kept: Bool[Array, "row"] = ~np.isin(measured.lines, list(reasons))
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
