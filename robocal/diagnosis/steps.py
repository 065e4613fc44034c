"""Effects that begin at one row: which rows can be the first, and which rows come after."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Coefficient, Instance

LEAST_ROWS = 4
"""A step needs so many rows on either side; [1]"""
_MOST_TRIED = 400
"""With more rows than this every n-th is tried, and the best one is refined; [1]"""


def steps_of(
    effect: str, joint: int | None, coefficients: tuple[Coefficient, ...], rows: Circumstances
) -> list[Instance]:
    """One instance a row that may be the first after the step."""
    first, last = LEAST_ROWS, len(rows) - LEAST_ROWS
    stride = max(1, (last - first) // _MOST_TRIED)
    return [
        Instance(effect, joint, (("line", float(rows.lines[row])),), coefficients)
        for row in range(first, last, stride)
    ]


def after_step(rows: Circumstances, instance: Instance) -> Float[Array, "row"]:
    """One from the step's line on, zero before."""
    return np.where(rows.lines >= instance.argument("line"), 1.0, 0.0)
