"""Effects that begin at one row: which rows can be the first, and which rows come after.

A step lies somewhere between the last row before it and the first after it. Rows of the campaign
that the fit does not use, those held out say, may stand in between: they get the share that is
expected of a moment which is as likely anywhere there.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Coefficient, Instance

LINE = "line"
"""First line after the step."""
LAST_BEFORE = "last_line_before"
LEAST_ROWS = 4
"""A step needs so many rows on either side; [1]"""
_MOST_TRIED = 400
"""With more rows than this every n-th is tried; [1]"""


def steps_of(
    effect: str, joint: int | None, coefficients: tuple[Coefficient, ...], rows: Circumstances
) -> list[Instance]:
    """One instance a row that may be the first after the step."""
    first, last = LEAST_ROWS, len(rows) - LEAST_ROWS
    stride = max(1, (last - first) // _MOST_TRIED)
    return [step_at(effect, joint, coefficients, rows, row) for row in range(first, last, stride)]


def step_at(
    effect: str,
    joint: int | None,
    coefficients: tuple[Coefficient, ...],
    rows: Circumstances,
    row: int,
) -> Instance:
    """The step just before one of the rows."""
    moment = ((LINE, float(rows.lines[row])), (LAST_BEFORE, float(rows.lines[max(row - 1, 0)])))
    return Instance(effect, joint, moment, coefficients)


def after_step(rows: Circumstances, instance: Instance) -> Float[Array, "row"]:
    """One from the step's line on, zero up to the last line before, in between in proportion."""
    before, line = gap_of(instance)
    return np.clip((rows.lines - before) / max(line - before, 1.0), 0.0, 1.0)


def is_step(instance: Instance) -> bool:
    """Whether the effect begins at one row."""
    return LINE in dict(instance.arguments)


def gap_of(instance: Instance) -> tuple[float, float]:
    """The last line before a step, and the first after it."""
    line = instance.argument(LINE)
    # Models written before the gap was kept say the first line alone.
    return dict(instance.arguments).get(LAST_BEFORE, line - 1.0), line
