"""From a bundle to the cause: show, name, say how sure, extend, measure the gain, ask for data."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.special import gammaincc

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.causes import itself_or_nothing, name_cause
from robocal.diagnosis.circumstances import Circumstances, Reference, circumstances
from robocal.diagnosis.covariates import SIGNIFICANT, Dependence, dependences
from robocal.diagnosis.diagnosis import (
    Diagnosis,
    NamedEffect,
    NextPoses,
    RowResiduals,
    Verdict,
)
from robocal.diagnosis.extended import FittedEffect, predict
from robocal.diagnosis.gain import blocks_of, gain_of, left_out_residuals, row_sizes
from robocal.diagnosis.joint_fit import JointFit, fit_jointly
from robocal.diagnosis.next_poses import split_causes
from robocal.diagnosis.screen import null_threshold
from robocal.diagnosis.select import Limits, select_effects, without
from robocal.formats.bundle import Bundle, RejectedRow
from robocal.frames import invert
from robocal.identification.adequacy import judge
from robocal.identification.identify import Prepared, prepare
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import Solution, frames_alone, solve_without_outliers
from robocal.measurements import MeasurementSet

FALSE_ALARM = 0.025
"""Chance that clean data have anything named; [1]"""
_NULL_DRAWS = 200
_NULL_ROWS = 300
_MOST_SMALL, _MOST_LARGE = 10, 60
"""Effects at most, with few and with many rows; [1]"""
_MANY_ROWS = 600
_MOST_NAMED = 10
"""Effects, the largest first, whose place is weighed against the whole catalogue; [1]"""


@dataclass(frozen=True)
class _Rows:
    """Some rows with their circumstances."""

    measured: MeasurementSet
    around: Circumstances


def diagnose(bundle: Bundle, provenance: Provenance) -> Diagnosis:
    """Find what the geometric model gets wrong.

    Parameters
    ----------
    bundle
        Measured rows; those held out choose nothing and measure the gain.
    provenance
        For the extended model.

    Raises
    ------
    BadInput
        If the bundle cannot be identified from.
    """
    ready = prepare(bundle, bundle.choices)
    observed = ready.observe(bundle, ~ready.rows.held_out)
    before = frames_alone(ready.start, observed, ready.choices, identify_simultaneously)
    solution = solve_without_outliers(before.cell, observed, ready.choices, identify_simultaneously)
    everything = _all_circumstances(bundle, ready, solution)
    chosen = ~ready.rows.held_out
    used = np.flatnonzero(chosen)[solution.used]
    fit_rows = everything.rows(_mask(used, len(everything)))
    geometric = fit_jointly(solution.problem, solution.fit.cell, fit_rows, ())
    threshold = _threshold(fit_rows, geometric)
    most = _MOST_LARGE if len(fit_rows) > _MANY_ROWS else _MOST_SMALL
    found = select_effects(solution.problem, solution.fit.cell, fit_rows, Limits(threshold, most))
    return _diagnosis(bundle, ready, solution, everything, geometric, found, used, provenance)


def _all_circumstances(bundle: Bundle, ready: Prepared, solution: Solution) -> Circumstances:
    """Of every row, in the order measured, so that each has its true predecessor."""
    cell = solution.fit.cell
    tool = invert(bundle.robot.geometry.flange) @ cell.geometry.tool_frame
    return circumstances(
        bundle.robot,
        bundle.gravity,
        tool[:3, 3],
        cell.geometry.base_frame[:3, :3],
        ready.rows,
    )


def _mask(index: Array, n: int) -> Bool[Array, "row"]:
    mask: Bool[Array, "row"] = np.zeros(n, dtype=bool)
    mask[index] = True
    return mask


def _threshold(rows: Circumstances, geometric: JointFit) -> float:
    """Null threshold, from some of the rows where there are many: their number hardly matters."""
    if len(rows) <= _NULL_ROWS:
        return null_threshold(rows, geometric.fit, FALSE_ALARM, _NULL_DRAWS, seed=1)
    few = np.unique(np.linspace(0, len(rows) - 1, _NULL_ROWS).astype(int))
    scalars = np.isin(geometric.fit.row, few)
    _, row = np.unique(geometric.fit.row[scalars], return_inverse=True)
    part = replace(
        geometric.fit,
        W=geometric.fit.W[:, scalars],
        row=row,
        r=geometric.fit.r[scalars],
        more=geometric.fit.more[scalars],
    )
    return null_threshold(rows.rows(_mask(few, len(rows))), part, FALSE_ALARM, _NULL_DRAWS, seed=1)


def _diagnosis(
    bundle: Bundle,
    ready: Prepared,
    solution: Solution,
    everything: Circumstances,
    geometric: JointFit,
    found: JointFit,
    used: Array,
    provenance: Provenance,
) -> Diagnosis:
    rows = everything.rows(_mask(used, len(everything)))
    held_out = ready.rows.held_out
    judged = held_out if held_out.any() else _mask(used, len(everything))
    measured = ready.rows
    before = _distances(measured, everything, geometric, ())
    after = _distances(measured, everything, found, found.effects)
    pose = measured.pose
    depends = tuple(d for d in dependences(rows, found.judged) if d.p_value < SIGNIFICANT)
    adequacy = judge(found.chi_square, found.nu)
    effects = _named(rows, geometric, found, measured, everything, judged, used)
    order = sorted(range(len(effects)), key=lambda k: -effects[k].explained_fraction)
    geometry = judge(geometric.chi_square, geometric.nu)
    lines = measured.lines[~held_out]
    outliers = tuple(
        RejectedRow(int(lines[row]), f"outlier, {solution.scores.sigmas[row]:.1f} sigma")
        for row in np.flatnonzero(~solution.used)
    )
    floor = bundle.instrument.position_std(np.nan_to_num(measured.position[judged]))
    return Diagnosis(
        verdict=_verdict(found, adequacy.adequate, depends),
        geometry_adequacy=geometry,
        lack_of_fit_p=float(gammaincc(geometric.nu / 2.0, geometric.chi_square / 2.0)),
        adequacy=adequacy,
        effects=tuple(effects[k] for k in order),
        outliers=outliers,
        depends_on=depends,
        gain=gain_of(before[judged], after[judged], pose[judged]),
        noise_floor=float(np.sqrt(3.0 * np.mean(floor**2))),
        next_poses=_next_poses(rows, found, effects),
        residuals=RowResiduals(measured.lines, held_out, before, after),
        calibrated=_calibrated(bundle, found, provenance, rows.reference),
        bundle_sha256=bundle.sha256,
        hidden=_hidden(rows),
    )


def _named(
    rows: Circumstances,
    geometric: JointFit,
    found: JointFit,
    measured: MeasurementSet,
    everything: Circumstances,
    judged: Bool[Array, "row"],
    used: Array,
) -> list[NamedEffect]:
    """Every effect with its causes, its share, and what the model loses without it."""
    after = _distances(measured, everything, found, found.effects)
    folds = blocks_of(measured.pose[used])
    full = row_sizes(found.judged, left_out_residuals(found.judged, folds))
    structure = max(geometric.chi_square - found.chi_square, 1e-300)
    now = float(found.judged.r @ found.judged.r)
    rests = [without(found, position) for position in range(len(found.effects))]
    dropped = [float(rest.r @ rest.r - now) * found.scale**2 for rest in rests]
    evidence = found.evidence_of_effects()
    leading = set(np.argsort(dropped)[::-1][:_MOST_NAMED].tolist())
    named = []
    for position, (fitted, rest) in enumerate(zip(found.effects, rests, strict=True)):
        less = row_sizes(rest, left_out_residuals(rest, folds))
        others = found.effects[:position] + found.effects[position + 1 :]
        lacking = _distances(measured, everything, found, others)
        named.append(
            NamedEffect(
                fitted=fitted,
                naming=name_cause(rows, found, position)
                if position in leading
                else itself_or_nothing(fitted.instance, float(evidence[position])),
                explained_fraction=min(max(dropped[position] / structure, 0.0), 1.0),
                gain=gain_of(lacking[judged], after[judged], measured.pose[judged]),
                blocked_gain=gain_of(less, full, measured.pose[used]),
            )
        )
    return named


def _distances(
    measured: MeasurementSet,
    everything: Circumstances,
    fit: JointFit,
    effects: tuple[FittedEffect, ...],
) -> Float[Array, "row"]:
    """Distance of every target from its prediction [m]; zero where there is no position."""
    sizes = np.zeros(len(measured))
    for place in {-1, *range(len(fit.cell.place_names))}:
        name = "" if place < 0 else fit.cell.place_names[place]
        here = np.array([target == name for target in measured.target])
        if here.any():
            target = predict(fit.cell.at_place(place), everything.rows(here), effects)
            miss = measured.position[here] - target.p.T
            sizes[here] = np.nan_to_num(np.linalg.norm(miss, axis=1))
    return sizes


def _verdict(found: JointFit, adequate: bool, depends: tuple[Dependence, ...]) -> Verdict:  # noqa: FBT001
    if not found.effects:
        return Verdict.model_adequate if adequate and not depends else Verdict.unknown_cause
    return Verdict.explained if adequate and not depends else Verdict.partly_explained


def _next_poses(rows: Circumstances, found: JointFit, effects: list[NamedEffect]) -> NextPoses:
    """For the effect whose name is least sure."""
    nothing = np.zeros((0, rows.n_joints))
    unsure = [effect for effect in effects if len(effect.naming.stated) > 1]
    if not unsure:
        return NextPoses(nothing, nothing, None, ())
    least = min(unsure, key=lambda effect: effect.naming.causes[0].probability)
    first, second = least.naming.causes[:2]
    return split_causes(rows, found, (first, second))


def _calibrated(
    bundle: Bundle, found: JointFit, provenance: Provenance, reference: Reference
) -> CalibratedRobot:
    model = found.cell.geometry
    n_free = len(found.fit.free)
    covariance = np.zeros((len(found.cell.names), len(found.cell.names)))
    covariance[np.ix_(found.fit.free, found.fit.free)] = found.covariance[:n_free, :n_free]
    n = model.n_parameters
    return CalibratedRobot(
        bundle.robot,
        model.with_frames_as_origin(),
        covariance[:n, :n],
        bundle.gravity,
        provenance,
        effects=found.effects,
        reference=reference,
    )


def _hidden(rows: Circumstances) -> tuple[str, ...]:
    """Effects of the catalogue without an instance in these rows, and what they need."""
    return tuple(
        f"{effect.name}: needs {effect.needs}"
        for effect in EFFECTS.values()
        if effect.needs and not effect.instances(rows)
    )
