"""A verifying campaign: what its computation is asked, and what its answer does to a version."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.campaigns import life, measurements
from service.campaigns.models import CriterionSettings
from service.db.models import CampaignRow, ParametersRow, PoseRow, ReadingRow, ResultRow
from service.parameters.life import note_verification
from service.parameters.models import Origin
from service.procedures.computation import Json
from service.procedures.plan import PURPOSE_NOMINAL


def verification_request(session: Session, row: CampaignRow) -> Json:
    """Pair the visits to each target: nominal joints, then what was reached either way."""
    nominal: dict[tuple[int, int], ReadingRow] = {}
    compensated: dict[tuple[int, int], ReadingRow] = {}
    for reading, purpose in session.execute(
        select(ReadingRow, PoseRow.purpose)
        .join(PoseRow, (PoseRow.campaign == ReadingRow.campaign) & (PoseRow.idx == ReadingRow.idx))
        .where(ReadingRow.campaign == row.id)
        .order_by(ReadingRow.repeat, ReadingRow.idx)
    ):
        side = nominal if purpose == PURPOSE_NOMINAL else compensated
        side[reading.idx // 2, reading.repeat] = reading
    # A target of which a person skipped one visit shows nothing.
    visits = [visit for visit in nominal if visit in compensated]
    return {
        "target": [target for target, _ in visits],
        "nominal_joints": [nominal[visit].commanded for visit in visits],
        "nominal_positions": [nominal[visit].position for visit in visits],
        "compensated_positions": [compensated[visit].position for visit in visits],
        "compensated_orientations": [compensated[visit].orientation for visit in visits],
        "fitted_joints": _fitted_joints(session, row),
        "criterion": CriterionSettings.model_validate(row.criterion or {}).model_dump(),
    }


def store_verification(session: Session, row: CampaignRow, result: ResultRow) -> None:
    """Let the verified version take its next step."""
    parameters = session.get_one(ParametersRow, (row.cell, row.parameters_version))
    origin = Origin(
        bundle_sha256=result.bundle_sha256,
        software_version=result.software_version,
        settings=result.settings,
        seed=row.seed,
    )
    note_verification(session, parameters, row.id, origin, result.document["reasons"])


def _fitted_joints(session: Session, row: CampaignRow) -> list[list[float]]:
    """Joints of the readings from which the version was computed [rad or m]."""
    parameters = session.get_one(ParametersRow, (row.cell, row.parameters_version))
    fitted = life.find(session, parameters.campaign)
    return measurements.joint_readings(session, fitted)
