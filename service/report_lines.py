"""What an identification says to a person at a terminal."""

from pathlib import Path

import numpy as np

from robocal.calibrated import UNKNOWN_BASE_ROTATION, UNKNOWN_ROTATION
from robocal.data_faults.slip import Slip
from robocal.diagnosis.diagnosis import Diagnosis, Verdict
from robocal.diagnosis.gain import Gain
from robocal.formats.bundle import RejectedRow
from robocal.identification.result import Identification, ResidualSummary
from robocal.measurements import MeasurementSet
from service.calibration import Calibration
from service.diagnosis_advice import negative_stiffness

_DEG = np.pi / 180.0
_MOST_ALONE = 5
"""Rows of one reason that have a line each; more share one."""


def identification_lines(done: Calibration, out: Path) -> list[str]:
    """A few lines: what was measured, what came out, what stays open."""
    bundle, result = done.bundle, done.result
    rows = bundle.measurements
    lines = [
        f"{bundle.robot.name}: {len(rows)} rows ({_kinds(rows)}), "
        f"{int(rows.held_out.sum())} held out",
        f"rank {result.rank}, condition {result.condition:.1f}, strategy {result.strategy}, "
        f"{result.iterations} iterations",
        f"{'':26}{'rows':>7}{'RMS mm':>10}{'mean mm':>10}{'max mm':>10}{'RMS deg':>10}",
        _line("nominal, frames fitted", result.before),
        _line("identified, fit rows", result.fit),
    ]
    if result.held_out:
        lines.append(_line("identified, held out", result.held_out))
    if done.folds:
        lines.append(_line(f"{done.folds.count} random folds", done.folds.random))
        lines.append(_line(f"{done.folds.count} blocked folds", done.folds.blocked))
    lines.append(result.adequacy.sentence)
    if result.drift:
        what = "removed" if result.drift.significant else "not significant, left alone"
        lines.append(f"station drift up to {result.drift.largest * 1e3:.4f} mm: {what}")
    lines += suspect_lines(result.suspect)
    lines += not_used_lines(result.rejected)
    for name, reason in result.unmet.items():
        lines.append(f"{name} was asked for, but is not identified: {reason}")
    lines += _redundant(result)
    if result.tool_known and not result.tool_rotation_known:
        lines.append(f"the tool's place alone is identified: {UNKNOWN_ROTATION}")
    if not result.base_rotation_known:
        lines.append(f"the base is not identified: {UNKNOWN_BASE_ROTATION}")
    if not result.converged:
        lines.append("the iteration did not converge; do not use these parameters")
    lines.append(f"-> {out / 'identification.json'}, {out / 'model.yaml'}")
    return lines


def _redundant(result: Identification) -> list[str]:
    """What the data do not tell apart, the parameters with the same reason in one line."""
    alike: dict[str, list[str]] = {}
    for name, reason in result.reasons.items():
        alike.setdefault(reason, []).append(name)
    return [f"redundant: {', '.join(names)}: {reason}" for reason, names in alike.items()]


def suspect_lines(rows: tuple[RejectedRow, ...]) -> list[str]:
    """Rows that chose nothing and yet look wrong; they count in what is gained."""
    return [f"measurements.csv line {row.line}, held out, is suspect: {row.reason}" for row in rows]


def not_used_lines(rows: tuple[RejectedRow, ...]) -> list[str]:
    """A line for every row that takes no part; one for many of one reason."""
    lines: dict[str, list[str]] = {}
    for row in rows:
        lines.setdefault(row.reason, []).append(str(row.line))
    told = []
    for reason, own in lines.items():
        together = (
            [f"s {', '.join(own)}"] if len(own) > _MOST_ALONE else [f" {line}" for line in own]
        )
        told += [f"measurements.csv line{which} not used: {reason}" for which in together]
    return told


def mended_lines(slips: tuple[Slip, ...]) -> list[str]:
    """One line for every slip of the data that a diagnosis mended."""
    return [f"{slip.report()} (mended before the diagnosis)" for slip in slips]


def _kinds(rows: MeasurementSet) -> str:
    """What the rows hold, the most common first: `40 positions, 20 distances` where mixed."""
    located = np.isfinite(rows.position[:, 0])
    counts = {
        "full poses": int((located & rows.has_orientation).sum()),
        "positions": int((located & ~rows.has_orientation).sum()),
        "orientations": int((~located & rows.has_orientation).sum()),
        "distances": int(np.isfinite(rows.distance).sum()),
    }
    there = [name for name in sorted(counts, key=lambda name: -counts[name]) if counts[name]]
    if len(there) == 1:
        return there[0]
    return ", ".join(f"{counts[name]} {name}" for name in there)


def _line(name: str, summary: ResidualSummary) -> str:
    angle = summary.orientation_rms
    return (
        f"{name:26}{summary.rows:7d}{summary.position_rms * 1e3:10.4f}"
        f"{summary.position_mean * 1e3:10.4f}{summary.position_max * 1e3:10.4f}"
        + (f"{angle / _DEG:10.4f}" if angle is not None else f"{'-':>10}")
    )


VERDICTS = {
    Verdict.model_adequate: "geometry alone explains these measurements",
    Verdict.explained: "explained: nothing but the declared noise is left",
    Verdict.partly_explained: "partly explained: structure remains beyond the named causes",
    Verdict.unknown_cause: "something is there that nothing of the catalogue explains",
}
_MOST_LINES = 12
_TOO_FEW = "too little is measured to judge the geometry by"
_ONLY_NOISE = "the residuals are larger than declared, and so is the scatter of repeats"
_LARGER = "what is left goes with nothing that was recorded: the noise may be stated too small"


def headline(found: Diagnosis) -> str:
    """The verdict for people, or why there is none."""
    if found.too_few:
        return _TOO_FEW
    if found.only_noise_is_larger:
        return _ONLY_NOISE
    return VERDICTS[found.verdict]


def noise_lines(found: Diagnosis) -> list[str]:
    """What speaks for a noise that is not as declared; where too little is measured, how little."""
    if found.too_few:
        return [found.adequacy.nothing_to_judge_by]
    repeats = found.pure_error
    if repeats is not None and repeats.is_larger_than_declared:
        return [repeats.sentence]
    unknown = found.verdict is Verdict.unknown_cause and not found.depends_on
    return [_LARGER] if unknown else []


def change_text(gain: Gain) -> str:
    """By how much the RMS fell, or rose, with its interval.

    >>> change_text(Gain(2.0, 1.0, (0.4, 0.6), 40))
    '50% less (95 %: 40% to 60%)'
    >>> change_text(Gain(1.0, 1.01, (-0.03, 0.01), 40))
    '1% more (95 %: -1% to 3%)'
    """
    low, high = gain.ci95
    if round(gain.reduction, 2) < 0.0:
        return f"{-gain.reduction:.0%} more (95 %: {-high:z.0%} to {-low:z.0%})"
    return f"{gain.reduction:z.0%} less (95 %: {low:z.0%} to {high:z.0%})"


def diagnosis_lines(found: Diagnosis, out: Path) -> list[str]:
    """The verdict, the causes with their certainty, the gain, what to do next."""
    gain = found.gain
    lines = [
        headline(found),
        *mended_lines(found.slips),
        f"reduced chi-square {found.geometry_adequacy.reduced_chi_square:.3g} by geometry, "
        f"{found.adequacy.reduced_chi_square:.3g} with the causes below",
    ]
    if not found.adequacy.judged and not found.too_few:
        lines.append(found.adequacy.sentence)
    elif found.adequacy.judged and found.adequacy.is_too_quiet:
        lines.append(found.adequacy.quiet_sentence)
    if found.pure_error is not None:
        lines.append(found.pure_error.lack_of_fit)
    lines += noise_lines(found)
    for named in found.effects[:_MOST_LINES]:
        own = (named.fitted.instance.effect, named.fitted.instance.joint)
        others = [cause for cause in named.naming.causes if cause.key != own][:2]
        choices = [f"{c.instance.title} ({c.probability:.2f})" for c in others]
        if named.naming.may_be_nothing:
            choices.append(f"nothing but noise ({named.naming.none:.2f})")
        alternative = ", ".join(choices)
        lines.append(
            f"  {named.fitted.instance.title:34} probability {named.probability:.3f}, "
            f"share {named.explained_fraction:.2f}"
            + (f"; or {alternative}" if alternative else "")
            + (f"; rather something unknown with {named.goes_with}" if named.goes_with else "")
            + ("; gain in sample only" if named.in_sample_only else "")
        )
        negative = negative_stiffness(named, found.calibrated.robot)
        if negative is not None:
            lines.append(f"    {negative}")
    if len(found.effects) > _MOST_LINES:
        lines.append(f"  and {len(found.effects) - _MOST_LINES} smaller ones")
    lines.append(
        f"position RMS on rows that chose nothing: {gain.before * 1e3:.4f} mm before, "
        f"{gain.after * 1e3:.4f} mm after, {change_text(gain)}; "
        f"noise floor {found.noise_floor * 1e3:.4f} mm"
    )
    lines += not_used_lines((*found.unusable, *found.outliers))
    lines += suspect_lines(found.suspect)
    if found.depends_on:
        names = ", ".join(dependence.covariate for dependence in found.depends_on[:5])
        lines.append(f"what remains depends on {names}")
    if found.next_poses.between:
        one, other = found.next_poses.between
        lines.append(f"to tell {one} from {other}: measure next_poses.csv")
        lines += [f"  or {word}" for word in found.next_poses.words]
    lines.append(f"-> {out / 'diagnosis.json'}, {out / 'model.yaml'}, {out / 'report.html'}")
    return lines
