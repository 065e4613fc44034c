"""A bundle made ready to fit: the station's drift taken out, and a start in closed form."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.bundle import Bundle
from robocal.frames import frame_from_xyz_ypr, invert, xyz_ypr_from_frame
from robocal.identification.cell_model import AXES, CellModel
from robocal.identification.drift_errors import drift_errors, widened
from robocal.identification.frames_start import start_frames
from robocal.identification.lengths_start import locate_anchor, start_from_lengths
from robocal.identification.observations import Observations, observations
from robocal.identification.priors import Choices
from robocal.identification.problem import residuals
from robocal.identification.refusals import (
    refuse_too_few,
    refuse_unknown_targets,
    refuse_unpredicted_lengths,
    refuse_unpredicted_nests,
)
from robocal.identification.station_drift import StationDrift, find_drift, remove_drift
from robocal.kinematics.model import FRAME_PARAMETERS
from robocal.measurements import MeasurementSet


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
    refuse_unknown_targets(bundle)
    if not len(rows.fit_rows):
        raise BadInput("measurements.csv", "no row is left to fit: all are held out or of nests")
    seen = {name for name in rows.target if name}
    place_names = tuple(
        name for name, target in bundle.targets.items() if name in seen and not target.fixed
    )
    fit_rows = observations(rows.fit_rows, bundle.instrument, place_names)
    refuse_unpredicted_lengths(rows, fit_rows)
    refuse_unpredicted_nests(bundle, rows)
    start = _start(bundle, fit_rows, place_names, choices)
    refuse_too_few(bundle, fit_rows, start, choices)
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
        axes = np.eye(3)
        if bundle.base_guess is not None:
            axes = frame_from_xyz_ypr(bundle.base_guess)[:3, :3]
        frames = start_from_lengths(geometry, rows, _stated_anchor(bundle), axes, len(place_names))
    base, tool = frames.base, frames.tool.copy()
    if bundle.tool_guess is not None:
        guess = frame_from_xyz_ypr(bundle.tool_guess)
        if not rows.has_orientation:
            tool[:3, :3] = guess[:3, :3]
        if not (rows.place < 0).any():
            tool[:3, 3] = guess[:3, 3]
    stated_base = _stated("base", bundle.base_guess, choices)
    stated_tool = _stated("tool", bundle.tool_guess, choices)
    origin = geometry.with_frames(
        base if stated_base is None else stated_base,
        geometry.flange @ (tool if stated_tool is None else stated_tool),
    ).with_frames_as_origin()
    robot = replace(
        origin,
        base=_away("base", stated_base, base, choices),
        tool=_away("tool", stated_tool, tool, choices),
    )
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


def _stated(
    frame: str, guess: Float[Array, "6"] | None, choices: Choices
) -> Float[Array, "4 4"] | None:
    """The campaign's own value of a frame that a choice speaks of; None where none does.

    Raises
    ------
    BadInput
        If one does and the campaign states no value.
    """
    spoken_of = [
        name for name in (*choices.fixed, *choices.prior_std) if name.startswith(f"{frame}_")
    ]
    if not spoken_of:
        return None
    if guess is None:
        name = min(spoken_of)
        wish = "fixed" if name in choices.fixed else "given a prior"
        raise BadInput(
            f"parameter '{name}'",
            f"cannot be {wish}: campaign.yaml states no {frame}_guess to hold it at",
        )
    return frame_from_xyz_ypr(guess)


def _away(
    frame: str,
    stated: Float[Array, "4 4"] | None,
    found: Float[Array, "4 4"],
    choices: Choices,
) -> Float[Array, "6"]:
    """Where the fit starts from the campaign's own value: there itself in what a choice holds."""
    if stated is None:
        return np.zeros(6)
    away = xyz_ypr_from_frame(invert(stated) @ found)
    held = choices.fixed | choices.prior_std.keys()
    return np.array([
        0.0 if f"{frame}_{name}" in held else value
        for name, value in zip(FRAME_PARAMETERS, away, strict=True)
    ])


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
