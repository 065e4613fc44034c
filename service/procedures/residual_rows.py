"""The residual of every row before and after identification, for plots and tables of a result."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.formats.bundle import Bundle
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.prepared import prepare
from robocal.identification.problem import residuals
from robocal.identification.result import Identification
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import frames_alone


@dataclass(frozen=True)
class ResidualRows:
    """Distance between measured and predicted target, one a row of the tool and its nests."""

    lines: Int[Array, "row"]
    poses: Int[Array, "row"]
    held_out: Bool[Array, "row"]
    rejected: Bool[Array, "row"]
    """Taken out of the fit as an outlier."""
    before: Float[Array, "row"]
    """Nominal geometry with base and tool fitted to the fit rows [m]."""
    after: Float[Array, "row"]
    """Identified geometry [m]."""


def residual_rows(bundle: Bundle, result: Identification) -> ResidualRows:
    """Row by row what `identification.json` sums up under `residuals`."""
    ready = prepare(bundle, bundle.choices)
    measured = ready.rows
    fit_rows = ready.observe(bundle, ~measured.held_out)
    before = frames_alone(ready.start, fit_rows, ready.choices, identify_simultaneously)
    rows = ready.observe(bundle, np.ones(len(measured), dtype=bool))
    rejected = [row.line for row in result.rejected]
    return ResidualRows(
        lines=measured.lines,
        poses=measured.pose,
        held_out=measured.held_out,
        rejected=np.isin(measured.lines, rejected),
        before=_distances(before.cell, rows),
        after=_distances(result.cell, rows),
    )


def residual_rows_document(rows: ResidualRows) -> dict[str, object]:
    """Columns, since thousands of rows are usual; lengths in mm."""
    return {
        "line": rows.lines.tolist(),
        "pose": rows.poses.tolist(),
        "held_out": rows.held_out.tolist(),
        "rejected": rows.rejected.tolist(),
        "before_mm": (rows.before * 1e3).round(6).tolist(),
        "after_mm": (rows.after * 1e3).round(6).tolist(),
    }


def _distances(cell: CellModel, rows: Observations) -> Float[Array, "row"]:
    """Distance of positions; where only a length was measured, how much it is off."""
    found = residuals(cell, rows)
    located = rows.position_weight > 0
    distance = np.where(located, np.linalg.norm(found.position, axis=0), np.abs(found.distance))
    return np.asarray(distance)
