"""The computation of a verification: accuracy before and after, ISO 9283 figures, the verdict."""

from pathlib import Path
from typing import Any

import numpy as np

from robocal.acceptance import Criterion, Verdict, fitted_targets, judge
from robocal.errors import NoAnswer
from robocal.formats.bundle import read_bundle
from robocal.formats.model_yaml import read_model
from robocal.frames import rotation_from_quaternion
from robocal.iso_9283 import PoseFigures, pose_figures, pose_figures_document
from robocal.verification import accuracy_after, accuracy_before, accuracy_document, wanted_poses

Json = dict[str, Any]


def verify(request: Json, folder: Path) -> Json:
    """Compare what was reached with what was wanted, before and after compensation.

    Raises
    ------
    NoAnswer
        If no target was visited both ways.
    """
    if not request["target"]:
        raise NoAnswer("no target was visited with nominal and with compensated joints")
    calibrated = read_model(folder / "model.yaml")
    nominal = np.array(request["nominal_joints"])
    reached = np.array(request["compensated_positions"])
    before = accuracy_before(calibrated, nominal, np.array(request["nominal_positions"]))
    after = accuracy_after(calibrated, nominal, reached)
    targets = np.array(request["target"])
    figures = _figures(targets, wanted_poses(calibrated, nominal), reached, request)
    first = np.unique(targets, return_index=True)[1]
    fitted = np.array(request["fitted_joints"]).reshape(-1, calibrated.robot.n_joints)
    seen = fitted_targets(nominal[first], fitted)
    AP = np.array([pose.AP_position for pose in figures])
    verdict = judge(AP, before, after, seen, _criterion(request["criterion"]))
    return {
        "bundle_sha256": read_bundle(folder).sha256,
        "settings": {"criterion": request["criterion"]},
        "verification": {
            "before": accuracy_document(before),
            "after": accuracy_document(after),
            "iso_9283": _iso_document(figures),
            "criterion": request["criterion"],
            "fitted_rows": len(fitted),
            "targets_seen_by_fit": seen,
            **_verdict_document(verdict),
        },
    }


def _figures(
    targets: np.ndarray, wanted: np.ndarray, reached: np.ndarray, request: Json
) -> list[PoseFigures]:
    """AP and RP of every target over its visits with compensated joints."""
    quaternions = request["compensated_orientations"]
    found = []
    for target in np.unique(targets):
        visits = np.flatnonzero(targets == target)
        turned = [quaternions[visit] for visit in visits]
        rotations = None
        if None not in turned:
            rotations = rotation_from_quaternion(np.array(turned))
        found.append(pose_figures(wanted[visits[0]], reached[visits], rotations))
    return found


def _criterion(settings: Json) -> Criterion:
    return Criterion(
        AP_mean=settings["pose_accuracy_mean_mm"] * 1e-3,
        AP_max=settings["pose_accuracy_max_mm"] * 1e-3,
        poses=settings["poses"],
    )


def _iso_document(figures: list[PoseFigures]) -> Json:
    AP = [pose.AP_position * 1e3 for pose in figures]
    RP = [pose.RP_position * 1e3 for pose in figures if pose.RP_position is not None]
    return {
        "poses": [pose_figures_document(pose) for pose in figures],
        "visits": min(pose.visits for pose in figures),
        "AP_p_mean_mm": float(np.mean(AP)),
        "AP_p_max_mm": max(AP),
        "RP_l_mean_mm": float(np.mean(RP)) if RP else None,
        "RP_l_max_mm": max(RP) if RP else None,
    }


def _verdict_document(verdict: Verdict) -> Json:
    return {"passed": verdict.passed, "reasons": list(verdict.reasons)}
