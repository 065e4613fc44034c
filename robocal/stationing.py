"""A calibrated robot taken to another station: base and tool fitted to a few poses, the rest kept.

What the robot itself does (geometry, gears, stiffness) goes with it; what belonged to the earlier
session does not: drift and steps of station and tool, the instrument, warming up by the clock. A
joint zero that jumped stays where it jumped to.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.joint_fit import whitened_residual
from robocal.diagnosis.linearised import linearise
from robocal.formats.bundle import Bundle
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.prepared import Prepared, prepare
from robocal.identification.priors import Choices
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import frames_alone
from robocal.measurements import MeasurementSet

OF_THE_SESSION = frozenset({
    "base_drift",
    "base_step",
    "tool_step",
    "warm_up",
    "instrument_scale",
    "instrument_angle",
})
_WORSE = 0.02
"""Share of the squared residual that an effect has to cost to be left behind; [1]"""
_STEPS = 8
_STANDSTILL = 1e-9
"""[m, rad]"""


@dataclass(frozen=True)
class Stationed:
    """The robot at its new station, and how well it fits there."""

    calibrated: CalibratedRobot
    distance: Float[Array, "row"]
    """Of every row's target from its prediction [m]."""
    held_out: Bool[Array, "row"]
    left_behind: tuple[str, ...]
    """Effects of the earlier session, which the new model lacks."""

    def rms(self, *, held_out: bool) -> float:
        """Of the distances of one kind of rows [m]; NaN without any."""
        chosen = self.distance[self.held_out == held_out]
        return float(np.sqrt(np.mean(chosen**2))) if len(chosen) else float("nan")


def station(calibrated: CalibratedRobot, bundle: Bundle, provenance: Provenance) -> Stationed:
    """Fit base and tool alone to the fit rows of a bundle of single-target poses.

    Parameters
    ----------
    calibrated
        As learnt elsewhere.
    bundle
        The same robot, measured where it stands now.
    provenance
        Of the new model; how adequate it is stays what was said of the one learnt elsewhere.

    Raises
    ------
    BadInput
        If the rows do not show base and tool.
    """
    kept = tuple(f for f in calibrated.effects if f.instance.effect not in OF_THE_SESSION)
    robot = replace(
        bundle.robot,
        geometry=replace(bundle.robot.geometry, links=_links_now(calibrated)),
    )
    lasting = tuple(f for f in kept if f.instance.effect != "encoder_step")
    ready = prepare(replace(bundle, robot=robot), Choices())
    rows = ready.observe(bundle, ~ready.rows.held_out)
    cell = frames_alone(ready.start, rows, ready.choices, identify_simultaneously).cell
    carried = _carried_over(calibrated, ready, rows, cell, lasting)
    moved = _fit_frames(calibrated, ready, rows, cell, carried)
    session = [f for f in calibrated.effects if f.instance.effect in OF_THE_SESSION]
    gone = [*session, *(f for f in lasting if f not in carried)]
    there = replace(
        calibrated,
        model=moved.cell.geometry.with_frames_as_origin(),
        covariance=moved.covariance,
        gravity=bundle.gravity,
        provenance=replace(provenance, adequacy=calibrated.provenance.adequacy),
        effects=carried,
        targets=moved.cell.targets,
        tool_known=bundle.tool_known,
        tool_rotation_known=bundle.tool_rotation_known,
        coefficient_covariance=_kept_covariance(calibrated, carried),
    )
    T = there.target_poses(ready.rows)
    distance = np.linalg.norm(ready.rows.position - T[:, :3, 3], axis=1)
    names = tuple(fitted.instance.title for fitted in gone)
    return Stationed(there, distance, ready.rows.held_out, names)


@dataclass(frozen=True)
class _Frames:
    """Fitted base and tool."""

    cell: CellModel
    covariance: Float[Array, "parameter parameter"]
    chi_square: float
    """Of the positions, where there are any."""


def _carried_over(
    calibrated: CalibratedRobot,
    ready: Prepared,
    rows: Observations,
    cell: CellModel,
    effects: tuple[FittedEffect, ...],
) -> tuple[FittedEffect, ...]:
    """Leave behind, kind by kind and joint by joint, what makes the new rows fit worse.

    What depended on the earlier station, an instrument's circle taken for a gear of joint 1 say,
    shows by that; no number is fitted, so few rows tell.
    """
    now = _fit_frames(calibrated, ready, rows, cell, effects).chi_square
    while True:
        places = dict.fromkeys((f.instance.effect, f.instance.joint) for f in effects)
        tried = [
            tuple(f for f in effects if (f.instance.effect, f.instance.joint) != place)
            for place in places
        ]
        found = [_fit_frames(calibrated, ready, rows, cell, rest).chi_square for rest in tried]
        if not found or min(found) > (1.0 - _WORSE) * now:
            return effects
        best = int(np.argmin(found))
        effects, now = tried[best], found[best]


def _links_now(calibrated: CalibratedRobot) -> Float[Array, "joint 5"]:
    """Links with the joint zeros where they were at the end of the earlier session."""
    links = calibrated.model.links.copy()
    for fitted in calibrated.effects:
        joint = fitted.instance.joint
        if fitted.instance.effect == "encoder_step" and joint is not None:
            links[joint - 1, int(calibrated.model.prismatic[joint - 1])] += fitted.values[0]
    return links


def _fit_frames(
    calibrated: CalibratedRobot,
    ready: Prepared,
    rows: Observations,
    cell: CellModel,
    effects: tuple[FittedEffect, ...],
) -> _Frames:
    """Gauss-Newton over the frames with the effects acting."""
    n = cell.geometry.n_parameters
    free = np.arange(n - 12, n if rows.has_orientation else n - 3)
    around = _around(calibrated, cell, ready.rows.rows(~ready.rows.held_out))
    for _ in range(_STEPS):
        fit = linearise(cell, rows, free, np.zeros(len(free)))
        residual = whitened_residual(cell, rows, around, effects)
        step = np.linalg.lstsq(fit.known, residual, rcond=None)[0]
        vector = cell.vector
        vector[free] += step
        cell = cell.with_vector(vector)
        if (np.abs(step) < _STANDSTILL).all():
            break
    covariance = calibrated.covariance.copy()
    covariance[-12:] = covariance[:, -12:] = 0.0
    covariance[np.ix_(free, free)] = np.linalg.pinv(fit.known.T @ fit.known)
    judged = rows
    if rows.has_position:
        # Places are what the model is for; an orientation tells the frames, not what to carry.
        judged = replace(rows, orientation_weight=np.zeros(len(rows)))
    residual = whitened_residual(cell, judged, around, effects)
    return _Frames(cell, covariance, float(residual @ residual))


def _kept_covariance(
    calibrated: CalibratedRobot, carried: tuple[FittedEffect, ...]
) -> Float[Array, "coefficient unknown"]:
    """Of the effects that came along; base and tool are found anew, whatever they were."""
    n = len(calibrated.covariance)
    kept = np.concatenate(
        [np.full(len(fitted.values), fitted in carried) for fitted in calibrated.effects]
        or [np.zeros(0, dtype=bool)]
    )
    rows = calibrated.joint_covariance[n:][kept]
    rows[:, n - 12 : n] = 0.0
    return np.asarray(np.concatenate([rows[:, :n], rows[:, n:][:, kept]], axis=1))


def _around(calibrated: CalibratedRobot, cell: CellModel, rows: MeasurementSet) -> Circumstances:
    model = cell.geometry.with_frames_as_origin()
    return replace(calibrated, model=model).circumstances_of(rows)
