"""From a bundle to the cause: show, name, say how sure, extend, measure the gain, ask for data."""

from dataclasses import replace

import numpy as np
from jaxtyping import Int
from numpy import ndarray as Array
from scipy.special import gammaincc

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.data_faults.search import find_slips
from robocal.data_faults.slip import mend_whichever
from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.causes import STATED
from robocal.diagnosis.circumstances import Circumstances, circumstances
from robocal.diagnosis.diagnosis import (
    Diagnosis,
    NamedEffect,
    NextPoses,
    RowResiduals,
    Verdict,
)
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.exchange import exchange_effects
from robocal.diagnosis.find import MOST_OUTLYING, Steps, find_effects
from robocal.diagnosis.gain import gain_of
from robocal.diagnosis.joint_fit import JointFit, fit_jointly
from robocal.diagnosis.judgeable_rows import judgeable
from robocal.diagnosis.judged_effects import judge_effects
from robocal.diagnosis.next_poses import split_causes
from robocal.diagnosis.pure_error import pure_error
from robocal.diagnosis.reference import Reference
from robocal.diagnosis.remaining import depends_on
from robocal.diagnosis.suspect import suspect_rows
from robocal.diagnosis.target_distances import Targets
from robocal.diagnosis.unseen import Unseen, unseen
from robocal.formats.bundle import Bundle, RejectedRow
from robocal.frames import invert
from robocal.identification.adequacy import judge
from robocal.identification.outliers import named_outliers
from robocal.identification.prepared import Prepared, prepare
from robocal.identification.priors import prior_centre
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import Solution, frames_alone, solve, solve_without_outliers

_DOUBTFUL = 0.5
"""Probability of a name below which it has to gain on left-out blocks, and of nothing being there
above which the effect goes; [1]"""


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
    NoAnswer
        If the data do not fit this robot, and no slip that is known explains it.
    """
    slips = find_slips(bundle)
    # The report tells all rival mends.
    rows = judgeable(mend_whichever(bundle, slips))
    bundle = rows.bundle
    ready = prepare(bundle, bundle.choices)
    held_out = ready.rows.held_out
    observed = ready.observe(bundle, ~held_out)
    before = frames_alone(ready.start, observed, ready.choices, identify_simultaneously)
    centre = prior_centre(before.cell, ready.start, ready.choices)
    fit = (before.cell, observed, ready.choices, identify_simultaneously, centre)
    solution = solve_without_outliers(*fit)
    if np.mean(~solution.used) > MOST_OUTLYING:
        solution = solve(*fit)
    targets = Targets(ready.rows, _all_circumstances(bundle, ready, solution))
    solution, steps = find_effects(targets, observed, solution, np.flatnonzero(~held_out))
    judged = unseen(targets, solution.problem, steps)
    effects = judge_effects(targets, steps.fitted, judged, steps.geometric, steps.found)
    doubtful = _doubtful(effects)
    if doubtful:
        steps = _without(doubtful, solution, steps)
        judged = unseen(targets, solution.problem, steps)
        effects = judge_effects(targets, steps.fitted, judged, steps.geometric, steps.found)
    said = _diagnosis(bundle, targets, solution, steps, judged, effects, provenance)
    suspect = suspect_rows(bundle, ready, targets, solution, steps)
    return replace(said, slips=slips, hidden=(*rows.unrecorded, *said.hidden), suspect=suspect)


def _doubtful(effects: list[NamedEffect]) -> set[Instance]:
    """Effects that probably are nothing, or something else and gain nothing on left-out blocks."""
    if len(effects) == 1:
        return set()
    return {
        fitted.instance
        for effect in effects
        if (effect.probability < _DOUBTFUL and effect.in_sample_only)
        or effect.naming.none > _DOUBTFUL
        for fitted in (effect.fitted, *effect.form_corrections)
    }


def _without(left_out: set[Instance], solution: Solution, steps: Steps) -> Steps:
    """The model fitted again without some effects."""
    found = steps.found
    kept = tuple(f.instance for f in found.effects if f.instance not in left_out)
    again = fit_jointly(solution.problem, found.cell, steps.rows, kept, found.effects)
    # What is left may have stood for a part of what is gone.
    return replace(steps, found=exchange_effects(solution.problem, steps.rows, again))


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


def _diagnosis(
    bundle: Bundle,
    targets: Targets,
    solution: Solution,
    steps: Steps,
    judged: Unseen,
    effects: list[NamedEffect],
    provenance: Provenance,
) -> Diagnosis:
    rows, geometric, found = steps.rows, steps.geometric, steps.found
    measured = targets.measured
    held_out, lines = measured.held_out, measured.lines[~measured.held_out]
    before, after = targets.with_all(geometric), targets.with_all(found)
    depends = depends_on(solution.problem, rows, found, effects)
    fitted = solution.problem.rows
    adequacy = judge(found.chi_square, found.nu, fitted.n_scalars / len(fitted))
    return Diagnosis(
        verdict=_verdict(found, adequate=adequacy.leaves_noise_alone and not depends),
        geometry_adequacy=judge(geometric.chi_square, geometric.nu),
        lack_of_fit_p=float(gammaincc(geometric.nu / 2.0, geometric.chi_square / 2.0)),
        pure_error=pure_error(geometric, found, measured.visit[steps.fitted]),
        adequacy=adequacy,
        effects=tuple(effects),
        unusable=_by_line(*bundle.rejected, *_unpredicted(lines, steps)),
        outliers=named_outliers(lines, solution.scores, ~solution.used & ~steps.unpredicted),
        depends_on=depends,
        gain=gain_of(judged.by_geometry(), judged.with_all(), judged.pose),
        noise_floor=targets.some(judged.rows).noise_floor(bundle.instrument),
        next_poses=_next_poses(rows, found, effects),
        residuals=RowResiduals(measured.lines, held_out, before, after),
        calibrated=_calibrated(bundle, found, provenance.judged_by(adequacy), rows.reference),
        bundle_sha256=bundle.sha256,
        hidden=_hidden(rows),
    )


def _by_line(*rows: RejectedRow) -> tuple[RejectedRow, ...]:
    return tuple(sorted(rows, key=lambda row: row.line))


def _unpredicted(lines: Int[Array, "row"], steps: Steps) -> tuple[RejectedRow, ...]:
    reason = "a joint may settle, and from where the arm came to the first row is not known"
    return tuple(RejectedRow(int(line), reason) for line in lines[steps.unpredicted])


def _verdict(found: JointFit, *, adequate: bool) -> Verdict:
    if not found.effects:
        return Verdict.model_adequate if adequate else Verdict.unknown_cause
    return Verdict.explained if adequate else Verdict.partly_explained


def _next_poses(rows: Circumstances, found: JointFit, effects: list[NamedEffect]) -> NextPoses:
    """For the effect whose name is least sure."""
    unsure = [
        effect
        for effect in effects
        # Poses split causes that have a name.
        if effect.naming.causes[0].probability < STATED and effect.goes_with is None
    ]
    if not unsure:
        nothing = np.zeros((0, rows.n_joints))
        return NextPoses(nothing, nothing, np.zeros(0), None, ())
    least = min(unsure, key=lambda effect: effect.naming.causes[0].probability)
    own = {fitted.instance for fitted in (least.fitted, *least.form_corrections)}
    positions = tuple(k for k, fitted in enumerate(found.effects) if fitted.instance in own)
    return split_causes(rows, found, positions, least.naming)


def _calibrated(
    bundle: Bundle, found: JointFit, provenance: Provenance, reference: Reference
) -> CalibratedRobot:
    model = found.cell.geometry
    n_free = len(found.fit.free)
    n_named, n_own = len(found.cell.names), len(found.covariance) - n_free
    known = np.concatenate([found.fit.free, n_named + np.arange(n_own)])
    whole = np.zeros((n_named + n_own, n_named + n_own))
    whole[np.ix_(known, known)] = found.covariance
    of_robot, of_coefficients, of_nests = found.cell.covariances_at_origin(whole)
    return CalibratedRobot(
        bundle.robot,
        model.with_frames_as_origin(),
        of_robot,
        bundle.gravity,
        provenance,
        effects=found.effects,
        reference=reference,
        targets=found.cell.targets,
        tool_known=bundle.tool_known,
        tool_rotation_known=bundle.tool_rotation_known,
        base_rotation_known=bundle.base_rotation_known,
        coefficient_covariance=of_coefficients,
        nest_covariance=of_nests,
    )


def _hidden(rows: Circumstances) -> tuple[str, ...]:
    """Effects of the catalogue without an instance in these rows, and what they need."""
    return tuple(
        f"{effect.name}: needs {effect.needs}"
        for effect in EFFECTS.values()
        if effect.needs and not effect.instances(rows)
    )
