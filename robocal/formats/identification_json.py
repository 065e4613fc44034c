"""`identification.json`: what an identification found, in file units."""

from dataclasses import asdict

import numpy as np

from robocal.formats.robot_yaml import frame_document
from robocal.identification.result import Identification, ResidualSummary
from robocal.kinematics.model import LINK_IS_ANGLE, LINK_PARAMETERS

_DEG = np.pi / 180.0


def identification_document(result: Identification) -> dict[str, object]:
    """The document that the contract describes."""
    return {
        "parameters": _parameters(result),
        "base": {
            **frame_document(result.base),
            "std": _frame_std(result, "base"),
        },
        "tool": {
            **frame_document(result.tool),
            "std": _frame_std(result, "tool"),
            "redundant": _redundant_tool(result),
        },
        "rank": result.rank,
        "condition": result.condition,
        "strategy": result.strategy,
        "iterations": result.iterations,
        "converged": result.converged,
        "chi_square": result.chi_square,
        "degrees_of_freedom": result.nu,
        "residuals": {
            "fit": _residuals(result.fit),
            "held_out": {} if result.held_out is None else _residuals(result.held_out),
            "before": _residuals(result.before),
        },
        "rejected_rows": [asdict(row) for row in result.rejected],
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
            if name in result.reasons:
                row["reason"] = result.reasons[name]
            rows.append(row)
    return rows


def _frame_std(result: Identification, which: str) -> list[float]:
    """Standard uncertainties in mm and deg."""
    std = result.frame_std(which)
    return [*(float(value) * 1e3 for value in std[:3]), *(float(v) / _DEG for v in std[3:])]


def _redundant_tool(result: Identification) -> dict[str, str]:
    """Frame parameters that the data leave open, with the reason."""
    return {name: text for name, text in result.reasons.items() if name.startswith("tool_")}


def _residuals(summary: ResidualSummary) -> dict[str, object]:
    angle = summary.orientation_rms
    return {
        "rows": summary.rows,
        "position_rms_mm": summary.position_rms * 1e3,
        "position_mean_mm": summary.position_mean * 1e3,
        "position_max_mm": summary.position_max * 1e3,
        "orientation_rms_deg": None if angle is None else angle / _DEG,
    }
