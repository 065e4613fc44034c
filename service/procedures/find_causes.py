"""The diagnosis of a bundle, as the numerics' process computes it for the service."""

import json
from datetime import datetime
from pathlib import Path
from typing import Any

from robocal.diagnosis.diagnose import diagnose
from robocal.diagnosis.diagnosis import Diagnosis
from robocal.formats.bundle import Bundle, read_bundle
from robocal.formats.diagnosis_json import NEXT_POSES, diagnosis_document
from robocal.formats.model_yaml import model_document
from robocal.formats.parameter_rows import parameter_rows
from robocal.formats.poses_csv import next_poses_text
from robocal.formats.robot_yaml import frame_document
from robocal.frames import invert
from robocal.identification.identify import DEFAULT_STRATEGY
from service.calibration import provenance_of
from service.diagnosis_report import report_html, report_parts

Json = dict[str, Any]
REPORT, PAGE = "report.html", "page.json"


def find_causes(request: Json, folder: Path) -> Json:
    """Diagnose the bundle in the folder; its files come back as text."""
    when = datetime.fromisoformat(request["date"])
    bundle = read_bundle(folder)
    found = diagnose(bundle, provenance_of(bundle, DEFAULT_STRATEGY, when))
    return {
        "bundle_sha256": bundle.sha256,
        "settings": {"strategy": DEFAULT_STRATEGY},
        "diagnosis": diagnosis_document(found),
        "files": {
            REPORT: report_html(bundle, found),
            PAGE: json.dumps(report_parts(bundle, found)),
            **_next_poses(bundle, found),
        },
        "next_joints": found.next_poses.q.tolist(),
        "next_approach": found.next_poses.approach.tolist(),
        "model": model_document(found.calibrated),
        "extended": _extended(found) if _gains(found) else None,
    }


def _gains(found: Diagnosis) -> bool:
    """Whether the effects make the model better on rows that chose nothing."""
    return bool(found.effects) and found.gain.ci95[0] > 0.0


def _extended(found: Diagnosis) -> Json:
    """The parameters of geometry beside the effects, as a version of the cell's parameters."""
    robot = found.calibrated
    tool = invert(robot.robot.geometry.flange) @ robot.model.tool_frame
    return {
        "parameters": parameter_rows(robot),
        "base": frame_document(robot.model.base_frame),
        "tool": frame_document(tool),
        "residuals": {
            "before": {"position_rms_mm": found.gain.before * 1e3},
            "held_out": {"position_rms_mm": found.gain.after * 1e3},
        },
    }


def _next_poses(bundle: Bundle, found: Diagnosis) -> dict[str, str]:
    if not len(found.next_poses.q):
        return {}
    return {NEXT_POSES: next_poses_text(bundle.robot, found.next_poses)}
