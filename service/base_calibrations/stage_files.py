"""A base calibration as the files that `robocal basecal` takes, so that it can be computed again.

The same touches make the same bytes: their hash names a result's origin.
"""

import csv
import hashlib
import io
import zipfile
from collections.abc import Sequence
from typing import Any

import yaml

from service.base_calibrations.models import (
    Geometry,
    NewBaseCalibration,
    Role,
    StageSettings,
    Touch,
    TouchingRobot,
)

_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a .zip can tell."""
_STAGE_FIELDS = (
    "sigma_slide_mm",
    "sigma_rod_mm",
    "sigma_angle_mrad",
    "level_in_master",
    "level_in_slave",
    "sigma_level_mrad",
    "slide_range_mm",
    "rod_angle_range_deg",
    "rod_length_range_mm",
)
_READINGS = ("slide_mm", "rod_angle_deg", "rod_length_mm")


def stage_files(
    settings: NewBaseCalibration, geometries: dict[Role, str], touches: Sequence[Touch]
) -> dict[str, bytes]:
    """Return stage.yaml, touches.csv and both robots' files; only touches that count.

    Parameters
    ----------
    settings
        As the base calibration was started with.
    geometries
        Contents of each robot's robot.yaml or model.yaml.
    touches
        All of them; voided ones are left out.
    """
    document = {
        "master": _robot(settings.master, Role.master),
        "slave": _robot(settings.slave, Role.slave),
        "stage": _stage(settings.stage),
        "touches": "touches.csv",
    }
    counted = [touch for touch in touches if touch.voided is None]
    return {
        "stage.yaml": yaml.safe_dump(document, sort_keys=False).encode(),
        "touches.csv": _table(counted).encode(),
        **{f"{role}.yaml": text.encode() for role, text in geometries.items()},
    }


def bundle_sha256(files: dict[str, bytes]) -> str:
    """Hash names and contents."""
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name} {len(files[name])}\n".encode() + files[name])
    return digest.hexdigest()


def zipped(files: dict[str, bytes]) -> bytes:
    """Pack the files; equal files make equal bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            archive.writestr(zipfile.ZipInfo(name, _EPOCH), files[name])
    return packed.getvalue()


def _robot(robot: TouchingRobot, role: Role) -> dict[str, Any]:
    kind = "model" if robot.geometry is Geometry.released else "robot"
    given = {"sigma_mm": robot.sigma_mm, "sigma_joint_mrad": robot.sigma_joint_mrad}
    return {
        kind: f"{role}.yaml",
        "needle_mm": list(robot.needle_mm),
        **{name: value for name, value in given.items() if value is not None},
    }


def _stage(stage: StageSettings) -> dict[str, Any]:
    given = stage.model_dump(mode="json", include=set(_STAGE_FIELDS))
    fields = {name: given[name] for name in _STAGE_FIELDS if given[name] is not None}
    return fields | ({"prior_std": stage.prior_std} if stage.prior_std else {})


def _table(touches: Sequence[Touch]) -> str:
    """Number of the touch as `line` is told by its place: comments are not part of the format."""
    columns = list(dict.fromkeys(column for touch in touches for column in touch.joints))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["robot", "cup", *columns, *_READINGS, "placement"])
    for touch in touches:
        joints = [touch.joints.get(column, "") for column in columns]
        readings = [touch.slide_mm, touch.rod_angle_deg, touch.rod_length_mm]
        writer.writerow([touch.robot, touch.cup, *joints, *readings, touch.placement])
    return text.getvalue()
