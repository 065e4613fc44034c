"""What an identification says to a person at a terminal."""

from pathlib import Path

import numpy as np

from robocal.identification.result import ResidualSummary
from service.calibration import Calibration

_DEG = np.pi / 180.0


def identification_lines(done: Calibration, out: Path) -> list[str]:
    """A few lines: what was measured, what came out, what stays open."""
    bundle, result = done.bundle, done.result
    rows = bundle.measurements
    kind = "full poses" if rows.has_orientation.all() else "positions"
    lines = [
        f"{bundle.robot.name}: {len(rows)} rows ({kind}), {int(rows.held_out.sum())} held out",
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
    for row in result.suspect:
        lines.append(f"measurements.csv line {row.line}, held out, is suspect: {row.reason}")
    for row in result.rejected:
        lines.append(f"measurements.csv line {row.line} not used: {row.reason}")
    if result.reasons:
        lines.append(f"redundant: {', '.join(result.reasons)}")
    if not result.converged:
        lines.append("the iteration did not converge; do not use these parameters")
    lines.append(f"-> {out / 'identification.json'}, {out / 'model.yaml'}")
    return lines


def _line(name: str, summary: ResidualSummary) -> str:
    angle = summary.orientation_rms
    return (
        f"{name:26}{summary.rows:7d}{summary.position_rms * 1e3:10.4f}"
        f"{summary.position_mean * 1e3:10.4f}{summary.position_max * 1e3:10.4f}"
        + (f"{angle / _DEG:10.4f}" if angle is not None else f"{'-':>10}")
    )
