"""From a bundle to the identified robot."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.bundle import Bundle, RejectedRow
from robocal.frames import frame_from_xyz_ypr
from robocal.identification.adequacy import judge
from robocal.identification.cell_model import AXES, CellModel
from robocal.identification.drift_errors import common_information, drift_errors, widened
from robocal.identification.frames_start import start_frames
from robocal.identification.lengths_start import locate_anchor, start_from_lengths
from robocal.identification.observations import Observations, observations
from robocal.identification.outliers import RowScores, score_rows
from robocal.identification.priors import Choices
from robocal.identification.problem import residuals
from robocal.identification.result import Identification, ResidualSummary
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import (
    Solution,
    covariance_of,
    frames_alone,
    full_rank,
    solve_without_outliers,
)
from robocal.identification.station_drift import StationDrift, find_drift, remove_drift
from robocal.identification.strategies import STRATEGIES
from robocal.measurements import MeasurementSet

DEFAULT_STRATEGY = "simultaneous"


@dataclass(frozen=True)
class Prepared:
    """A bundle made ready to fit: rows in one frame, a start, and what must not move."""

    rows: MeasurementSet
    """Rows of the tool and its nests; the station's drift is taken out."""
    place_names: tuple[str, ...]
    start: CellModel
    choices: Choices
    drift: StationDrift | None

    def observe(self, bundle: Bundle, chosen: Bool[Array, "row"]) -> Observations:
        """Some of the rows, weighted by the instrument."""
        rows = observations(self.rows.rows(chosen), bundle.instrument, self.place_names)
        errors = self.drift_errors(chosen)
        return rows if errors is None else widened(rows, errors)

    def drift_errors(self, chosen: Bool[Array, "row"]) -> Float[Array, "chosen 6 noise"] | None:
        """What the noise of the fixed nests leaves in some rows; None where no drift is removed."""
        if self.drift is None or not self.drift.significant:
            return None
        return drift_errors(self.drift, self.rows.rows(chosen))


def identify(
    bundle: Bundle, strategy: str = DEFAULT_STRATEGY, choices: Choices | None = None
) -> Identification:
    """Identify geometry, base, tool and nests from the fit rows of a bundle.

    Parameters
    ----------
    bundle
        Full poses, positions, lengths from an anchor, or any mixture.
    strategy
        One of `strategies.STRATEGIES`.
    choices
        Parameters to fix, to free, or with priors of their own; the bundle's if None.

    Raises
    ------
    BadInput
        If the rows hold fewer numbers than there are parameters, or a name is unknown.
    """
    if strategy not in STRATEGIES:
        known = ", ".join(STRATEGIES)
        raise BadInput(f"strategy '{strategy}'", f"is not known; known are {known}")
    ready = prepare(bundle, bundle.choices if choices is None else choices)
    rows = ready.observe(bundle, ~ready.rows.held_out)
    how = STRATEGIES[strategy]
    before = frames_alone(ready.start, rows, ready.choices, identify_simultaneously)
    solution = solve_without_outliers(before.cell, rows, ready.choices, how)
    held_out = ready.observe(bundle, ready.rows.held_out) if ready.rows.held_out.any() else None
    return _result(bundle, ready, strategy, solution, rows, held_out, before.cell)


def prepare(bundle: Bundle, choices: Choices) -> Prepared:
    """Take the station's drift out, and find a start in closed form."""
    fixed_names = {name for name, target in bundle.targets.items() if target.fixed}
    of_fixed = np.array([name in fixed_names for name in bundle.measurements.target], dtype=bool)
    drift = None
    rows = bundle.measurements
    if of_fixed.any():
        drift = find_drift(rows, of_fixed, bundle.instrument)
        if drift is not None and drift.significant:
            rows = remove_drift(rows, drift)
        rows = rows.rows(~of_fixed)
    _refuse_unknown_targets(bundle)
    if not len(rows.fit_rows):
        raise BadInput("measurements.csv", "no row is left to fit: all are held out or of nests")
    seen = {name for name in rows.target if name}
    place_names = tuple(
        name for name, target in bundle.targets.items() if name in seen and not target.fixed
    )
    fit_rows = observations(rows.fit_rows, bundle.instrument, place_names)
    start = _start(bundle, fit_rows, place_names, choices)
    _refuse_too_few(bundle, fit_rows, start)
    choices = _with_known_places(bundle, choices, place_names)
    if not fit_rows.has_position and fit_rows.has_distance:
        anchor = frozenset(f"anchor_{axis}" for axis in AXES)
        choices = replace(choices, fixed=choices.fixed | anchor)
    choices.check(start.names)
    return Prepared(rows, place_names, start, choices, drift)


def _start(
    bundle: Bundle, rows: Observations, place_names: tuple[str, ...], choices: Choices
) -> CellModel:
    """Nominal links; frames, nests and anchor at their closed-form start.

    What the rows do not see, the tool's rotation say, is taken from the campaign's guesses.
    """
    geometry = bundle.robot.geometry
    if rows.has_position:
        frames = start_frames(geometry, rows, len(place_names))
    else:
        frames = start_from_lengths(geometry, rows, _stated_anchor(bundle), len(place_names))
    base, tool = frames.base, frames.tool.copy()
    if bundle.tool_guess is not None:
        guess = frame_from_xyz_ypr(bundle.tool_guess)
        if not rows.has_orientation:
            tool[:3, :3] = guess[:3, :3]
        if not (rows.place < 0).any():
            tool[:3, 3] = guess[:3, 3]
    base = _held("base", base, bundle.base_guess, choices)
    tool = _held("tool", tool, bundle.tool_guess, choices)
    robot = geometry.with_frames(base, geometry.flange @ tool).with_frames_as_origin()
    places = frames.places.copy()
    for index, name in enumerate(place_names):
        known = bundle.targets[name].place
        if known is not None:
            places[index] = known
    cell = CellModel(robot, geometry.flange, place_names, places)
    if not rows.has_distance:
        return cell
    cell = replace(cell, anchor=np.array(bundle.anchor or (0.0, 0.0, 0.0)))
    if bundle.anchor is None:
        measured = rows.choose(rows.distance_weight > 0)
        points = -residuals(cell, _as_positions(measured)).position.T
        cell = replace(cell, anchor=locate_anchor(points, measured.distance))
    return cell


def _stated_anchor(bundle: Bundle) -> Float[Array, "3"]:
    """Where lengths are measured from; they alone cannot say where that is in any frame.

    Raises
    ------
    BadInput
        If the campaign does not state it.
    """
    if bundle.anchor is None:
        raise BadInput(
            "campaign.yaml",
            "field 'anchor' is missing: with distances alone it says where the measuring frame is; "
            "write anchor: {xyz_mm: [x, y, z]}, with 0, 0, 0 the frame begins at the anchor",
        )
    return np.array(bundle.anchor)


def _held(
    frame: str,
    found: Float[Array, "4 4"],
    guess: Float[Array, "6"] | None,
    choices: Choices,
) -> Float[Array, "4 4"]:
    """The start of a frame: the campaign's own value where any of its parameters is fixed.

    Raises
    ------
    BadInput
        If one is fixed and the campaign states no value.
    """
    fixed = [name for name in choices.fixed if name.startswith(f"{frame}_")]
    if not fixed:
        return found
    if guess is None:
        raise BadInput(
            f"parameter '{min(fixed)}'",
            f"cannot be fixed: campaign.yaml states no {frame}_guess to hold it at",
        )
    return frame_from_xyz_ypr(guess)


def _as_positions(rows: Observations) -> Observations:
    """The same joints with a position of zero, whose residual is the prediction's negative."""
    nothing = np.zeros(len(rows))
    return replace(
        rows,
        position=np.zeros((3, len(rows))),
        position_weight=np.ones(len(rows)),
        orientation_weight=nothing,
        distance_weight=nothing,
    )


def _with_known_places(bundle: Bundle, choices: Choices, place_names: tuple[str, ...]) -> Choices:
    """Nests whose place the campaign states are held there, unless asked for otherwise."""
    known = [
        f"target_{name}_{axis}"
        for name in place_names
        if bundle.targets[name].place is not None
        for axis in AXES
    ]
    asked = choices.free | choices.prior_std.keys()
    return replace(choices, fixed=choices.fixed | (frozenset(known) - asked))


def summarise(cell: CellModel, rows: Observations) -> ResidualSummary:
    """Size of the residuals over some rows."""
    found = residuals(cell, rows)
    size = np.linalg.norm(found.position, axis=0)
    located = rows.position_weight > 0
    if not located.any():
        size, located = np.abs(found.distance), rows.distance_weight > 0
    size = size[located]
    turned = rows.orientation_weight > 0
    angle = np.linalg.norm(found.orientation[:, turned], axis=0)
    return ResidualSummary(
        rows=len(rows),
        position_rms=float(np.sqrt(np.mean(size**2))) if len(size) else 0.0,
        position_mean=float(size.mean()) if len(size) else 0.0,
        position_max=float(size.max(initial=0.0)),
        orientation_rms=float(np.sqrt(np.mean(angle**2))) if turned.any() else None,
    )


def _result(
    bundle: Bundle,
    ready: Prepared,
    strategy: str,
    solution: Solution,
    rows: Observations,
    held_out: Observations | None,
    before: CellModel,
) -> Identification:
    fit, problem = solution.fit, solution.problem
    cell, reasons = fit.cell, solution.redundancy.reasons
    lines = ready.rows.lines[~ready.rows.held_out]
    covariance, nu = solution.covariance, solution.nu
    shared = _shared_error(ready, solution)
    if shared is not None:
        nu -= float(np.sum(covariance * shared))
        covariance = covariance + covariance @ shared @ covariance
    rejected = _named(lines, solution.scores, ~solution.used)
    suspect: tuple[RejectedRow, ...] = ()
    if held_out is not None:
        took_part = np.zeros(len(held_out), dtype=bool)
        scale = solution.scores.scale
        scores = score_rows(cell, held_out, problem.free, covariance_of(fit), took_part, scale)
        suspect = _named(ready.rows.lines[ready.rows.held_out], scores, scores.outlying)
    return Identification(
        nominal=bundle.robot.geometry,
        cell=replace(cell, geometry=cell.geometry.with_frames_as_origin()),
        free=problem.free,
        covariance=covariance,
        reasons=reasons,
        choices=ready.choices.without_free(reasons),
        unmet={name: reasons[name] for name in sorted(reasons) if ready.choices.speaks_of(name)},
        rank=solution.redundancy.rank,
        condition=solution.redundancy.condition,
        strategy=strategy,
        iterations=fit.iterations,
        converged=fit.converged,
        adequacy=judge(solution.chi_square, nu),
        fit=summarise(cell, rows.choose(solution.used)),
        held_out=None if held_out is None else summarise(cell, held_out),
        before=summarise(before, rows if held_out is None else held_out),
        rejected=(*bundle.rejected, *rejected),
        suspect=suspect,
        drift=ready.drift,
        bundle_sha256=bundle.sha256,
        tool_known=bundle.tool_known,
    )


def _shared_error(ready: Prepared, solution: Solution) -> Float[Array, "free free"] | None:
    """What the station's drift leaves in all rows alike; None where no drift was removed."""
    used = ~ready.rows.held_out
    used[used] = solution.used
    errors = ready.drift_errors(used)
    if errors is None:
        return None
    problem = solution.problem
    return common_information(solution.fit.cell, problem.rows, problem.free, errors)


def _named(
    lines: Float[Array, "row"] | Array, scores: RowScores, which: Bool[Array, "row"]
) -> tuple[RejectedRow, ...]:
    return tuple(
        RejectedRow(int(lines[row]), f"outlier, {scores.sigmas[row]:.1f} sigma")
        for row in np.flatnonzero(which)
    )


def _refuse_unknown_targets(bundle: Bundle) -> None:
    rows = bundle.measurements
    for line, target in zip(rows.lines, rows.target, strict=True):
        if target and target not in bundle.targets:
            known = ", ".join(bundle.targets) or "none"
            raise BadInput(
                f"measurements.csv line {line}",
                f"target '{target}' is not listed in campaign.yaml (listed: {known})",
            )


def _refuse_too_few(bundle: Bundle, rows: Observations, start: CellModel) -> None:
    wanted = full_rank(start, rows)
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
