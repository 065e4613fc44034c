"""From a bundle's folder to the calibrated robot, with its provenance."""

from datetime import datetime
from importlib.metadata import version
from pathlib import Path

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.formats.bundle import Bundle, read_bundle
from robocal.formats.model_yaml import calibrated_robot
from robocal.identification.identify import identify
from robocal.identification.result import Identification


def calibrate(
    folder: Path, strategy: str, when: datetime
) -> tuple[Bundle, Identification, CalibratedRobot]:
    """Read, identify, and put the result into its lasting form."""
    bundle = read_bundle(folder)
    result = identify(bundle, strategy)
    provenance = Provenance(
        bundle.sha256, version("robocal"), when.isoformat(timespec="seconds"), strategy
    )
    return bundle, result, calibrated_robot(bundle.robot, result, bundle.gravity, provenance)
