"""Rows of a table that no fit can use, each with its reason."""

import numpy as np

from robocal.measurements import MeasurementSet


def unusable_rows(measurements: MeasurementSet) -> dict[int, str]:
    """Row index and reason of every row that no fit can use."""
    reasons: dict[int, str] = {}
    no_joints = np.isnan(measurements.joints).any(axis=1)
    parts = np.isfinite(measurements.position).sum(axis=1)
    nothing = (parts == 0) & np.isnan(measurements.distance)
    torn = (parts > 0) & (parts < 3)
    turned = np.isfinite(measurements.orientation).sum(axis=1)
    half_turned = (turned > 0) & (turned < 4)
    for row in np.flatnonzero(no_joints | nothing | torn | half_turned):
        if no_joints[row]:
            reasons[int(row)] = "a joint reading is missing"
        elif nothing[row]:
            reasons[int(row)] = "neither position nor distance"
        elif torn[row]:
            reasons[int(row)] = "a coordinate of the position is missing"
        else:
            reasons[int(row)] = "a part of the quaternion is missing"
    return reasons


def copied_rows(measurements: MeasurementSet) -> dict[int, str]:
    """Row index and reason of every row that was pasted twice: it would count as measured twice.

    A coarse instrument repeats its reading too. So a row is a copy only where times tell rows
    apart, no two others of one target having the same, and where every column agrees.
    """
    parts = (
        *(measurements.joints, measurements.position, measurements.orientation),
        *(measurements.approach, measurements.commanded),
        *(measurements.distance, measurements.temperature, measurements.payload),
        *(measurements.speed, measurements.settle),
    )
    cells = np.column_stack(parts)
    seen: dict[tuple[str, float], bytes] = {}
    copies: dict[int, str] = {}
    for row in np.flatnonzero(np.isfinite(measurements.time)).tolist():
        moment, cell = (measurements.target[row], measurements.time[row]), cells[row].tobytes()
        if seen.setdefault(moment, cell) is cell:
            continue
        if seen[moment] != cell:
            return {}
        copies[row] = "a copy of an earlier row, with the same t_s"
    return copies
