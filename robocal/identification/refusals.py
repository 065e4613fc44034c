"""Bundles that cannot be fitted, or not judged, as they are: one sentence each."""

import numpy as np

from robocal.errors import BadInput
from robocal.formats.bundle import Bundle
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.priors import Choices
from robocal.identification.solve import frames_rank, full_rank
from robocal.measurements import MeasurementSet


def refuse_unknown_targets(bundle: Bundle) -> None:
    """A row measures a nest that campaign.yaml does not list."""
    rows = bundle.measurements
    for line, target in zip(rows.lines, rows.target, strict=True):
        if target and target not in bundle.targets:
            known = ", ".join(bundle.targets) or "none"
            raise BadInput(
                f"measurements.csv line {line}",
                f"target '{target}' is not listed in campaign.yaml (listed: {known})",
            )


def refuse_unpredicted_lengths(rows: MeasurementSet, fit_rows: Observations) -> None:
    """Lengths are held out, but none is fitted: where they are measured from is not known."""
    lengths = rows.held_out & np.isfinite(rows.distance)
    if lengths.any() and not fit_rows.has_distance:
        raise BadInput(
            f"measurements.csv line {rows.lines[np.argmax(lengths)]}",
            "distance_mm is held out, but no row with distance_mm is fitted, so where lengths are "
            "measured from stays unknown; fit some of these rows, or leave them out",
        )


def refuse_unpredicted_nests(bundle: Bundle, rows: MeasurementSet) -> None:
    """Rows of a nest are held out, but none is fitted: where the nest lies is not known."""
    fitted = set(rows.fit_rows.target)
    for line, name, held_out in zip(rows.lines, rows.target, rows.held_out, strict=True):
        if held_out and name and name not in fitted and bundle.targets[name].place is None:
            raise BadInput(
                f"measurements.csv line {line}",
                f"a row of nest '{name}' is held out, but none is fitted, so where the nest lies "
                "stays unknown; fit some of its rows, leave them out, or state its xyz_mm in "
                "campaign.yaml",
            )


def refuse_too_few(bundle: Bundle, rows: Observations, start: CellModel, choices: Choices) -> None:
    """Fewer numbers, or fewer different poses, than there are parameters to find."""
    wanted = full_rank(start, rows)
    links = start.names[: 5 * start.geometry.n_joints]
    n_fixed = sum(name in choices.fixed for name in links)
    if n_fixed:
        wanted = min(wanted, len(links) - n_fixed + frames_rank(start, rows))
    _, first = np.unique(np.round(rows.joints, 6), axis=0, return_index=True)
    different = int(rows.scalars_of_row[first].sum()) * max(len(start.place_names), 1)
    if min(rows.n_scalars, different) < wanted:
        least = -(-wanted * len(rows) // max(rows.n_scalars, 1))
        raise BadInput(
            f"measurements.csv lines {bundle.measurements.lines[0]} to "
            f"{bundle.measurements.lines[-1]}",
            f"{len(rows)} rows to fit, {len(first)} different poses among them, give "
            f"{min(rows.n_scalars, different)} numbers for {wanted} parameters; "
            f"measure at least {least} different poses besides those held out",
        )
