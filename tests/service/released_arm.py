"""Parameters of a robot whose true poses an independent program knows."""

from robocal.formats.model_yaml import model_document
from service.parameters.models import ParametersContent, Provenance
from tests.robocal.formats.calibrated_arms import CalibratedArm

WHY = {"reason": "commissioning"}


def content_of(arm: CalibratedArm, campaign: int = 1) -> ParametersContent:
    return ParametersContent(
        parameters=[],
        base={},
        tool={},
        residuals={},
        uncertainty={},
        model=model_document(arm.calibrated),
        provenance=Provenance(
            campaign=campaign, bundle_sha256="ab" * 32, software_version="0", computed="2026-11-22"
        ),
    )
