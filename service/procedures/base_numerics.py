"""What the child process computes of a base calibration's stage file."""

from pathlib import Path
from typing import Any

from robocal.base_calibration.monte_carlo import draw_registrations
from robocal.base_calibration.projection import project
from robocal.base_calibration.registration import register
from robocal.formats.basecal_json import basecal_document, registration_document
from robocal.formats.stage import read_stage

Json = dict[str, Any]

STAGE = "stage.yaml"


def assess_base(request: Json, folder: Path) -> Json:
    """Register the touches made so far, and find the best next one."""
    del request
    measured = read_stage(folder / STAGE)
    return registration_document(
        register(measured.touches, measured.stage, measured.travel, measured.pair)
    )


def calibrate_base(request: Json, folder: Path) -> Json:
    """Make basecal.json, as `robocal basecal` does."""
    measured = read_stage(folder / STAGE)
    result = register(measured.touches, measured.stage, measured.travel, measured.pair)
    drawn = draw_registrations(
        result.solution, result.touches, result.stage, request["draws"], request["seed"]
    )
    return basecal_document(result, project(measured.touches, measured.stage), drawn)
