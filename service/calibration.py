"""From a bundle's folder to the calibrated robot, with its provenance."""

from dataclasses import dataclass, replace
from datetime import datetime
from importlib.metadata import version
from pathlib import Path

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.formats.bundle import Bundle, read_bundle
from robocal.formats.model_yaml import calibrated_robot
from robocal.identification.identify import identify
from robocal.identification.priors import Choices
from robocal.identification.result import Identification
from robocal.identification.validation import Folds, cross_validate


@dataclass(frozen=True)
class Calibration:
    """What was measured and what came out."""

    bundle: Bundle
    result: Identification
    folds: Folds | None
    calibrated: CalibratedRobot


def calibrate(
    folder: Path, strategy: str, when: datetime, choices: Choices | None = None
) -> Calibration:
    """Read, identify, validate, and put the result into its lasting form.

    `choices` are added to those of the campaign and go before them.
    """
    bundle = read_bundle(folder)
    if choices is not None:
        bundle = replace(bundle, choices=bundle.choices.overruled_by(choices))
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
