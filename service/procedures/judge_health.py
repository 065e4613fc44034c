"""The computation of a health check: what the readings say."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from robocal.calibrated import CalibratedRobot
from robocal.errors import NoAnswer
from robocal.formats.bundle import read_bundle
from robocal.formats.measurements_csv import joint_columns
from robocal.formats.model_yaml import read_model
from robocal.health.check import Alternative, HealthCheck, check_health, look_alike
from robocal.health.poses import discriminating_poses
from robocal.health.residual import Residual, residual_of
from robocal.instrument import InstrumentNoise
from robocal.measurements import unmeasured_rows

Json = dict[str, Any]

_ONLY_REFIT = "robocal station fits base and tool anew from a few poses"
_ADVICE = {
    "base": f"The base or the tracker moved. No full campaign: {_ONLY_REFIT}.",
    "tool": f"The target or the tool moved. No full campaign: {_ONLY_REFIT}.",
    "joint": "One joint's zero jumped. Look at its motor and encoder, then run a full campaign.",
    "temperature": "The arm has another temperature than at its calibration. No full campaign: "
    "let it reach that temperature, or calibrate with a temperature probe.",
}
_HEALTHY = "Nothing to do."
_UNEXPLAINED = "No single movement explains the readings; run a full campaign."
_UNDECIDED = "These readings cannot tell {} from {}; measure the poses in next_poses too."


def judge_health(request: Json, folder: Path) -> Json:
    """Whether the model is still right, and what moved if not.

    Raises
    ------
    NoAnswer
        If there are no readings.
    """
    if not request["joints"]:
        raise NoAnswer("no pose of the health check was measured")
    calibrated = read_model(folder / "model.yaml")
    now, then = request["temperature_degc"], request["calibrated_at_degc"]
    held = request["payload_kg"]
    warming = None if now is None or then is None else now - then
    rows = replace(
        unmeasured_rows(
            np.array(request["joints"]),
            # Neither this campaign nor the one before it states a payload: it holds none.
            held or 0.0,
            np.nan if now is None else now,
        ),
        position=np.array(request["positions"]),
        approach=np.array(request["approach"], dtype=float),
        speed=np.array(request["speed"]),
        settle=np.array(request["settle_s"]),
    )
    instrument = InstrumentNoise(request["sigma_mm"] * 1e-3, request["sigma_ppm"] * 1e-6)
    # The figure of the calibration holds the instrument's noise already.
    floor = request["unexplained_mm"] * 1e-3 / np.sqrt(3.0)
    noise = np.maximum(instrument.position_std(rows.position), floor)
    residual = residual_of(calibrated, rows, noise)
    found = check_health(residual, warming)
    return {
        "bundle_sha256": read_bundle(folder).sha256,
        "settings": {"unexplained_mm": request["unexplained_mm"]},
        "health": {
            **_document(found, residual),
            "next_poses": _next_poses(calibrated, found, request["seed"]),
            "poses": len(rows),
            "temperature_degc": now,
            "calibrated_at_degc": then,
        },
    }


def _document(found: HealthCheck, residual: Residual) -> Json:
    moved, full, advice = _conclusion(found)
    return {
        "alarm": found.alarm,
        "chi_square": found.chi_square,
        "degrees_of_freedom": found.nu,
        "chi_square_limit": found.limit,
        "p_value": found.p_value,
        "z": found.z,
        "position_rms_mm": found.position_rms * 1e3,
        "moved": moved,
        "full_campaign_needed": full,
        "advice": advice,
        "alternatives": [_alternative(one, found, residual) for one in found.alternatives],
    }


def _conclusion(found: HealthCheck) -> tuple[str | None, bool, str]:
    """What moved, whether a full campaign is needed, and what to do."""
    if not found.alarm:
        return None, False, _HEALTHY
    if not found.explained:
        return None, True, _UNEXPLAINED
    first = found.alternatives[0].movement
    advice = _ADVICE[first.family]
    if len(found.undecided) > 1:
        names = [_in_words(one) for one in found.undecided[:2]]
        advice = f"{advice} {_UNDECIDED.format(*names)}"
    return first.name, first.family == "joint", advice


def _in_words(one: Alternative) -> str:
    return one.movement.name.replace("_", " ")


def _alternative(one: Alternative, found: HealthCheck, residual: Residual) -> Json:
    others = (other.movement for other in found.alternatives if other is not one)
    return {
        "movement": one.movement.name,
        "probability": one.probability,
        "explains": one.p_value,
        "numbers": {
            name: {"value": float(value) * scale, "std": float(std) * scale}
            for (name, scale), value, std in zip(
                _units(one, residual), one.numbers, one.std, strict=True
            )
        },
        "looks_like": [
            other.name for other in others if look_alike(one.movement, other, residual, one.numbers)
        ],
    }


def _units(one: Alternative, residual: Residual) -> list[tuple[str, float]]:
    """Names with units, and the factor from SI."""
    shift, turn = 1e3, 1e3
    if one.movement.family == "temperature":
        return [("growth_ppm", 1e6)]
    if one.movement.family == "joint":
        joint = int(one.movement.name.removeprefix("joint_")) - 1
        slides = bool(residual.model.prismatic[joint])
        return [("zero_mm", shift)] if slides else [("zero_mrad", turn)]
    names = one.movement.numbers
    return [(f"{name}_mm", shift) if name in "xyz" else (f"{name}_mrad", turn) for name in names]


def _next_poses(calibrated: CalibratedRobot, found: HealthCheck, seed: int) -> list[Json]:
    """Poses at which the two likeliest explanations differ most, in the units of files."""
    if len(found.undecided) < 2:
        return []
    first, second = found.undecided[:2]
    q, difference = discriminating_poses(calibrated, first, second, seed)
    columns = joint_columns(calibrated.robot)
    in_file_units = (q / calibrated.robot.joint_scale).round(6).tolist()
    return [
        {**dict(zip(columns, row, strict=True)), "difference_mm": float(apart) * 1e3}
        for row, apart in zip(in_file_units, difference, strict=True)
    ]
