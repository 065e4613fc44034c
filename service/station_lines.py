"""What is said of a robot taken to another station, to a program and to a person."""

from dataclasses import asdict
from pathlib import Path

from robocal.calibrated import UNKNOWN_BASE_ROTATION
from robocal.formats.bundle import Bundle
from robocal.formats.identification_json import adequacy_document
from robocal.identification.result import ResidualSummary
from robocal.stationing import Stationed
from service.report_lines import not_used_lines


def station_document(found: Stationed, bundle: Bundle) -> dict[str, object]:
    """`station.json`."""
    return {
        "fit": _residuals(found.fit),
        "held_out": _residuals(found.held_out),
        "adequacy": adequacy_document(found.adequacy),
        "left_behind": list(found.left_behind),
        "rejected_rows": [asdict(row) for row in (*bundle.rejected, *found.outliers)],
    }


def station_lines(found: Stationed, bundle: Bundle, out: Path) -> list[str]:
    """How well the robot fits there, and what was left out."""
    fit, held_out = found.fit, found.held_out
    lines = [f"base and tool fitted to {fit.rows} rows: {fit.position_rms * 1e3:.4f} mm RMS"]
    if held_out is not None:
        rms = held_out.position_rms * 1e3
        lines.append(f"on {held_out.rows} rows that were held out: {rms:.4f} mm RMS")
    lines.append(found.adequacy.sentence)
    lines += not_used_lines((*bundle.rejected, *found.outliers))
    if not found.calibrated.base_rotation_known:
        lines.append(f"the base is not identified: {UNKNOWN_BASE_ROTATION}")
    if found.left_behind:
        lines.append(f"left behind with the earlier session: {', '.join(found.left_behind)}")
    lines.append(f"-> {out / 'station.json'}, {out / 'model.yaml'}")
    return lines


def _residuals(summary: ResidualSummary | None) -> dict[str, object]:
    if summary is None:
        return {"rows": 0, "position_rms_mm": None}
    return {"rows": summary.rows, "position_rms_mm": summary.position_rms * 1e3}
