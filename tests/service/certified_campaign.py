"""A campaign whose results are stored as its worker stores them, without anything computed."""

from threading import Event
from typing import Any

from robocal.formats.model_yaml import model_document
from service.db.engine import Database
from service.jobs.queue import Claim, JobKind
from service.jobs.table_queue import TableQueue
from service.jobs.watch import Watch
from service.procedures import diagnose
from service.procedures.analyse import store_calibration
from service.procedures.job import Job
from tests.robocal.formats.calibrated_arms import calibrated_arm

Json = dict[str, Any]

CELL = {
    "name": "c1",
    "robot": {"model": "ur10e", "driver": "mock", "address": "127.0.0.1:9"},
    "tracker": {
        "driver": "mock",
        "address": "127.0.0.1:9",
        "calibration": {
            "certificate": "DKD-4711",
            "date": "2026-03-01",
            "laboratory": "<PTB> & Co",
        },
    },
}
FIGURES = {"position_rms_mm": 0.0267, "position_mean_mm": 0.0246, "position_max_mm": 0.0401}
IDENTIFICATION = {
    "base": {},
    "tool": {},
    "parameters": [
        {
            "name": "theta_2",
            "unit": "deg",
            "nominal": -90,
            "identified": -89.97,
            "std": 0.0004,
            "status": "identified",
        },
        {"name": "d_3", "unit": "mm", "nominal": 0, "identified": 0, "std": 0, "status": "fixed"},
    ],
    "rank": 27,
    "condition": 41.2,
    "strategy": "simultaneous",
    "residuals": {
        "before": {**FIGURES, "position_rms_mm": 1.8579},
        "fit": FIGURES,
        "held_out": FIGURES,
    },
}
MODEL = model_document(calibrated_arm("ur10e").calibrated)
EFFECT = {
    "effect": "joint_compliance",
    "joint": 2,
    "arguments": {},
    "coefficients": {"compliance_rad_per_nm": {"value": 1.25e-6, "std": 1e-7}},
}
DIAGNOSIS = {
    "verdict": "explained",
    "effects": [{"effect": "joint_compliance", "joint": 2, "probability": 0.97}],
}


def _job(database: Database) -> Job:
    queue = TableQueue(database, lease_s=60)
    claim = Claim(1, 1, "c1", JobKind.analyse, 1, 0.0)
    return Job(database, queue, claim, Watch(queue, claim, lambda: None, Event(), 1.0))


def _parameters(theta_2_deg: float) -> list[Json]:
    first, *others = IDENTIFICATION["parameters"]
    return [first | {"identified": theta_2_deg}, *others]


def identify_again(
    database: Database, theta_2_deg: float = -89.97, rms_before_mm: float = 1.8579
) -> None:
    """Give campaign 1 a version of the geometry."""
    before = {"before": {**FIGURES, "position_rms_mm": rms_before_mm}}
    changed = {
        "parameters": _parameters(theta_2_deg),
        "residuals": IDENTIFICATION["residuals"] | before,
    }
    answer = {
        "identification": IDENTIFICATION | changed,
        "uncertainty": {"tool_position": {"U95_mean_mm": 0.0213}},
        "model": MODEL | {"gravity": [0.0, theta_2_deg, -1.0]},
        "bundle_sha256": "ab" * 32,
        "settings": {"strategy": "simultaneous"},
    }
    with database.write() as session:
        store_calibration(session, _job(database), answer)


def find_effects(database: Database, theta_2_deg: float, rms_after_mm: float) -> None:
    """Give campaign 1 a version with effects."""
    answer = {
        "diagnosis": DIAGNOSIS,
        "files": {},
        "next_joints": [],
        "next_approach": [],
        "model": MODEL | {"effects": [EFFECT]},
        "extended": {
            "parameters": _parameters(theta_2_deg),
            "base": {},
            "tool": {},
            "residuals": {
                "before": {"position_rms_mm": 0.2134},
                "held_out": {"position_rms_mm": rms_after_mm},
            },
        },
        "bundle_sha256": "ab" * 32,
        "settings": {"strategy": "simultaneous"},
    }
    with database.write() as session:
        diagnose._store(session, _job(database), answer)
