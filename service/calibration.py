"""From a bundle to the calibrated robot, with its provenance."""

from dataclasses import dataclass
from datetime import datetime
from importlib.metadata import version

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.formats.bundle import Bundle
from robocal.formats.model_yaml import calibrated_robot
from robocal.identification.identify import identify
from robocal.identification.result import Identification
from robocal.identification.validation import Folds, cross_validate


@dataclass(frozen=True)
class Calibration:
    """What was measured and what came out."""

    bundle: Bundle
    result: Identification
    folds: Folds | None
    calibrated: CalibratedRobot


def calibrate_bundle(bundle: Bundle, strategy: str, when: datetime) -> Calibration:
    """Identify, validate, and put the result into its lasting form."""
    result = identify(bundle, strategy)
    folds = cross_validate(bundle, result)
    provenance = provenance_of(bundle, strategy, when)
    robot = calibrated_robot(bundle.robot, result, bundle.gravity, provenance)
    return Calibration(bundle, result, folds, robot)


def provenance_of(bundle: Bundle, strategy: str, when: datetime) -> Provenance:
    """Where a model comes from: these readings, this software, this moment."""
    return Provenance(
        bundle.sha256, version("robocal"), when.isoformat(timespec="seconds"), strategy
    )
