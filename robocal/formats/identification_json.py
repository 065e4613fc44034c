"""`identification.json`: what an identification found, in file units."""

from dataclasses import asdict

import numpy as np

from robocal.formats.robot_yaml import frame_document
from robocal.identification.adequacy import Adequacy
from robocal.identification.result import AXES_OF_STD, Identification, ResidualSummary
from robocal.identification.validation import Folds
from robocal.kinematics.model import LINK_IS_ANGLE, LINK_PARAMETERS

_DEG = np.pi / 180.0


def identification_document(
    result: Identification, folds: Folds | None = None
) -> dict[str, object]:
    """The document that the contract describes; with the left-out folds where these were made."""
    return {
        "parameters": _parameters(result),
        "base": {
            **frame_document(result.base),
            "std": _base_std(result),
            "std_axes": AXES_OF_STD["base"],
            "rotation_known": result.base_rotation_known,
            "redundant": _redundant(result, "base"),
        },
        "tool": {
            **frame_document(result.tool),
            "std": _tool_std(result),
            "std_axes": AXES_OF_STD["tool"],
            "rotation_known": result.tool_rotation_known,
            "redundant": _redundant(result, "tool"),
        },
        "choices": {
            "fixed": sorted(result.choices.fixed),
            "free": sorted(result.choices.free),
            "prior_std": _own_priors(result),
            "not_met": result.unmet,
        },
        "rank": result.rank,
        "condition": result.condition,
        "strategy": result.strategy,
        "iterations": result.iterations,
        "converged": result.converged,
        "adequacy": adequacy_document(result.adequacy),
        "residuals": {
            "fit": _residuals(result.fit),
            "held_out": {} if result.held_out is None else _residuals(result.held_out),
            "before": _residuals(result.before),
            "random_folds": _residuals(folds.random) if folds else {},
            "blocked_folds": _residuals(folds.blocked) if folds else {},
        },
        "rejected_rows": [asdict(row) for row in result.rejected],
        "suspect_held_out_rows": [asdict(row) for row in result.suspect],
        "targets": _targets(result),
        "anchor": _point(result, "anchor"),
        "station_drift": _drift(result),
        "bundle_sha256": result.bundle_sha256,
    }


def _parameters(result: Identification) -> list[dict[str, object]]:
    rows: list[dict[str, object]] = []
    std = result.std
    for joint, link in enumerate(result.model.links):
        for column, (parameter, angle) in enumerate(
            zip(LINK_PARAMETERS, LINK_IS_ANGLE, strict=True)
        ):
            name = f"{parameter}_{joint + 1}"
            unit = _DEG if angle else 1e-3
            status = result.status(name)
            row: dict[str, object] = {
                "name": name,
                "unit": "deg" if angle else "mm",
                "nominal": float(result.nominal.links[joint, column]) / unit,
                "identified": float(link[column]) / unit,
                "std": float(std[5 * joint + column]) / unit,
                "status": status.value,
            }
            if name in result.unmet:
                row["reason"] = f"asked for, but not identified: {result.reasons[name]}"
            elif name in result.reasons:
                row["reason"] = result.reasons[name]
            if name in result.combinations:
                row["identified_with"] = _combination(result, name, unit)
            rows.append(row)
    return rows


def _combination(result: Identification, name: str, unit: float) -> dict[str, float]:
    """How far others move the target as a mm or degree of a parameter does, in mm and degrees."""
    angle = dict(zip(result.cell.names, result.cell.is_angle, strict=True))
    return {
        other: move * unit / (_DEG if angle[other] else 1e-3)
        for other, move in result.combinations[name].items()
    }


def _own_priors(result: Identification) -> dict[str, float]:
    """Keys as the campaign and the command line give them: `a_2_mm`, `theta_3_deg`."""
    angle = dict(zip(result.cell.names, result.cell.is_angle, strict=True))
    return {
        f"{name}_deg" if angle[name] else f"{name}_mm": std / (_DEG if angle[name] else 1e-3)
        for name, std in sorted(result.choices.prior_std.items())
    }


def adequacy_document(adequacy: Adequacy) -> dict[str, object]:
    """Verdict, figure and sentence."""
    some = adequacy.nu > 0
    return {
        "verdict": "adequate" if adequacy.adequate else "inadequate",
        "judged": adequacy.judged,
        "reduced_chi_square": adequacy.reduced_chi_square if some else None,
        "degrees_of_freedom": adequacy.nu,
        "band99": [adequacy.low, adequacy.high] if some else None,
        "sentence": adequacy.sentence,
    }


def _targets(result: Identification) -> dict[str, object]:
    """Nests on the tool, in the flange frame."""
    return {name: _point(result, f"target_{name}") for name in result.cell.place_names}


def _point(result: Identification, prefix: str) -> dict[str, object] | None:
    """A point by its three parameters, None where the cell has none of that name."""
    names = result.cell.names
    if f"{prefix}_x" not in names:
        return None
    first = names.index(f"{prefix}_x")
    part = slice(first, first + 3)
    return {
        "xyz_mm": [float(value) * 1e3 for value in result.cell.vector[part]],
        "std": [float(value) * 1e3 for value in result.std[part]],
        "status": [result.status(name).value for name in names[part]],
    }


def _drift(result: Identification) -> dict[str, object] | None:
    """Motion of the station since its nests were first visited."""
    drift = result.drift
    if drift is None:
        return None
    return {
        "removed": drift.significant,
        "p_value": drift.p_value,
        "largest_mm": drift.largest * 1e3,
        "visits": [
            {
                "t_s": float(time),
                "translation_mm": [float(value) * 1e3 for value in translation],
                "rotation_mrad": [float(value) * 1e3 for value in rotation],
            }
            for time, translation, rotation in zip(
                drift.time, drift.translation, drift.rotation, strict=True
            )
        ],
    }


def _frame_std(result: Identification, which: str) -> list[float]:
    """Standard uncertainties in mm and deg."""
    std = result.frame_std(which)
    return [*(float(value) * 1e3 for value in std[:3]), *(float(v) / _DEG for v in std[3:])]


def _base_std(result: Identification) -> list[float | None]:
    """The same of the base; None where it may stand anywhere about the anchor."""
    std = _frame_std(result, "base")
    return [*std] if result.base_rotation_known else [None] * len(std)


def _tool_std(result: Identification) -> list[float | None]:
    """The same of the tool; None for its angles where nothing tells them: zero would be a claim."""
    std = _frame_std(result, "tool")
    return [*std] if result.tool_rotation_known else [*std[:3], None, None, None]


def _redundant(result: Identification, which: str) -> dict[str, str]:
    """Parameters of `base` or `tool` that the data leave open, with the reason."""
    start = f"{which}_"
    return {name: text for name, text in result.reasons.items() if name.startswith(start)}


def _residuals(summary: ResidualSummary) -> dict[str, object]:
    angle = summary.orientation_rms
    return {
        "rows": summary.rows,
        "position_rms_mm": summary.position_rms * 1e3,
        "position_mean_mm": summary.position_mean * 1e3,
        "position_max_mm": summary.position_max * 1e3,
        "orientation_rms_deg": None if angle is None else angle / _DEG,
    }
