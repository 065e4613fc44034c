"""Examples in the API's description: one for every request body and for the main answers.

They tell one story: the robot of cell welding-3 is calibrated, its version 2 is released, an MES
reads it, and a health check finds it sound. A test holds each against its model.
"""

from types import MappingProxyType
from typing import Any

from fastapi import FastAPI
from pydantic import BaseModel

from service.access import models as access
from service.base_calibrations import models as stage
from service.campaigns import models as campaigns
from service.cells import models as cells
from service.compensation import models as compensation
from service.errors import ProblemDocument
from service.health_checks import models as health
from service.parameters import models as parameters
from service.webhooks import models as webhooks

_ROBOT = {"model": "ur10e", "driver": "ur_rtde", "address": "192.168.40.10"}
_REFERENCE = {
    "certificate": "DKD-K-41102-26-03",
    "date": "2026-03-01",
    "laboratory": "Plant metrology laboratory",
}
_TRACKER = {
    "driver": "geocom",
    "address": "/dev/ttyUSB0",
    "sigma_mm": 0.015,
    "sigma_ppm": 6.0,
    "calibration": _REFERENCE,
}
_LIMITS = {"speed_deg_s": 30.0, "joints": {"j1_deg": [-120.0, 120.0]}}
_CELL = {"name": "welding-3", "robot": _ROBOT, "tracker": _TRACKER, "limits": _LIMITS}
_HASH = "9f2c1d7e5b8a40363d1e8f0a7c6b5948e3d2c1b0a99887766554433221100ffe"
_ORIGIN = {"bundle_sha256": _HASH, "software_version": "1.0.0", "seed": 41}
_CAMPAIGN = {
    "id": 41,
    "cell": "welding-3",
    "kind": "calibrate",
    "state": "running",
    "done": 12,
    "total": 50,
    "skipped": 0,
    "remaining_s": 380.0,
    "reason": "",
    "revision": 14,
    "repeats": 1,
    "settle_s": 0.5,
    "seed": 41,
    "parameters_version": None,
    "created": "2026-11-20T08:00:00+00:00",
    "started": "2026-11-20T08:00:02+00:00",
    "finished": None,
}
_PARAMETERS = {
    "cell": "welding-3",
    "version": 2,
    "state": "released",
    "created": "2026-11-20T08:10:31+00:00",
    "released": "2026-11-20T09:02:10+00:00",
    "parameters": [
        {
            "name": "theta_2",
            "unit": "deg",
            "nominal": 0.0,
            "identified": 0.0183,
            "std": 0.0011,
            "status": "identified",
            "reason": "",
        }
    ],
    "base": {"xyz_mm": [2100.4, -310.2, 12.7], "quaternion": [1.0, 0.0, 0.0, 0.0]},
    "tool": {"xyz_mm": [50.1, 29.8, 100.3]},
    "residuals": {"held_out": {"rows": 10, "position_rms_mm": 0.041}},
    "uncertainty": {},
    "model": {},
    "provenance": {"campaign": 41, "computed": "2026-11-20T08:10:31+00:00", **_ORIGIN},
}
_STEP = {
    "id": 7,
    "version": 2,
    "event": "released",
    "person": "person anna",
    "reason": "verified after the gearbox was changed",
    "campaign": 42,
    "origin": _ORIGIN,
    "at": "2026-11-20T09:02:10+00:00",
}
_HEALTH = {
    "campaign": 57,
    "at": "2026-12-01T06:04:40+00:00",
    "parameters_version": 2,
    "alarm": False,
    "trend_alarm": False,
    "chi_square": 21.8,
    "chi_square_limit": 49.7,
    "degrees_of_freedom": 24,
    "p_value": 0.59,
    "z": -0.22,
    "ewma": 0.04,
    "ewma_limit": 0.87,
    "position_rms_mm": 0.044,
    "temperature_degc": 23.1,
    "moved": None,
    "full_campaign_needed": False,
    "advice": "Nothing to do.",
}
_SUBSCRIPTION = {
    "url": "https://mes.plant.example/robocal",
    "events": ["parameters.released", "drift.alarm"],
    "cell": "welding-3",
}
_DECISION = {"reason": "verified after the gearbox was changed"}

REQUESTS: MappingProxyType[type[BaseModel], dict[str, Any]] = MappingProxyType({
    cells.NewCell: _CELL,
    cells.CellChange: {"limits": _LIMITS},
    campaigns.NewCampaign: {"cell": "welding-3", "kind": "calibrate", "poses": 50},
    campaigns.Resumption: {"skip_pose": True},
    campaigns.IdentificationWish: {"fix": ["d_4"], "prior": ["a_2_mm=0.2"]},
    compensation.CompensationRequest: {
        "poses": [{"xyz_mm": [1500.0, -200.0, 650.0], "quaternion": [0.0, 1.0, 0.0, 0.0]}]
    },
    parameters.Decision: _DECISION,
    webhooks.NewWebhook: _SUBSCRIPTION,
    access.LogIn: {"name": "anna", "password": "nine-blue-herons"},
    access.NewPassword: {"old": "nine-blue-herons", "new": "eleven-grey-geese"},
    access.Welcome: {"token": "from-the-link", "name": "anna", "password": "nine-blue-herons"},
    access.NewUser: {"name": "anna", "role": "operate"},
    access.NewKey: {"name": "mes", "scope": "read"},
    stage.NewBaseCalibration: {
        "name": "line-1",
        "master": {"cell": "welding-3", "geometry": "released", "needle_mm": [0, 0, 120]},
        "slave": {"cell": "welding-4", "geometry": "released", "needle_mm": [0, 0, 120]},
        "stage": {"slide_range_mm": [0, 600], "rod_length_range_mm": [300, 900]},
    },
    stage.NewTouch: {"robot": "master", "cup": "rod"},
    stage.Voiding: {"reason": "the needle did not sit in the cup"},
})
"""By the body's model."""

ANSWERS: MappingProxyType[type[BaseModel], dict[str, Any]] = MappingProxyType({
    cells.Cell: _CELL | {"armed": False, "created": "2026-11-19T14:00:00+00:00"},
    campaigns.Accepted: {"id": 41, "state": "queued"},
    campaigns.Campaign: _CAMPAIGN,
    parameters.Parameters: _PARAMETERS,
    parameters.LifeStep: _STEP,
    compensation.CompensatedJoints: {
        "cell": "welding-3",
        "version": 2,
        "orientation_of": "tool",
        "columns": ["j1_deg", "j2_deg", "j3_deg", "j4_deg", "j5_deg", "j6_deg"],
        "joints_deg": [[20.013, -80.127, 95.204, -100.031, -85.002, 10.118], None],
        "joints": None,
        "reached": 1,
        "missed": [
            {
                "pose": 1,
                "status": "not_reached",
                "detail": "Pose 1: the calibrated robot does not reach it.",
            }
        ],
    },
    health.HealthPoint: _HEALTH,
    webhooks.WebhookCreated: _SUBSCRIPTION
    | {
        "id": 3,
        "created": "2026-11-20T09:00:00+00:00",
        "created_by": "key mes",
        "secret": "shown-this-once",
    },
    stage.Finished: {"id": 5, "name": "line-1", "version": 1},
    ProblemDocument: {
        "title": "Conflict",
        "status": 409,
        "detail": "Cell 'welding-3' is not armed: go and look that nobody is inside and nothing "
        "in the way, then arm the cell first.",
    },
})
"""By the answer's model; a list is shown by what it lists."""


def install(app: FastAPI) -> None:
    """Put the examples into the API's description."""
    plain = app.openapi

    def described() -> dict[str, Any]:
        is_new = app.openapi_schema is None
        document = plain()
        if is_new:
            schemas = document["components"]["schemas"]
            for model, example in (REQUESTS | ANSWERS).items():
                schemas[model.__name__]["examples"] = [example]
        return document

    app.__dict__["openapi"] = described
