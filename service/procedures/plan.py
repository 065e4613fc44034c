"""The poses of a campaign, computed once and stored before anything moves."""

import yaml
from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from service.campaigns.models import CampaignKind
from service.campaigns.store import PURPOSE_CALIBRATE, store_plan
from service.db.models import CampaignRow, ParametersRow, PoseRow
from service.procedures.computation import Json, compute
from service.procedures.job import Job

MODEL = "model.yaml"
PURPOSE_NOMINAL, PURPOSE_COMPENSATED = "nominal", "compensated"


def ensure_plan(job: Job) -> None:
    """Plan the campaign's poses unless that was done before."""
    with job.database.read() as session:
        row = session.get_one(CampaignRow, job.campaign)
        if session.scalar(select(exists().where(PoseRow.campaign == row.id))):
            return
        kind = CampaignKind(row.kind)
        files = {"robot.yaml": row.robot_yaml.encode()}
        request: Json = {"count": row.pose_count, "seed": row.seed}
        if kind is CampaignKind.verify:
            files[MODEL] = model_to_verify(session, row)
    if kind is CampaignKind.verify:
        joints, purposes = _alternate(compute("plan_verify", files, request, job.watch))
    else:
        joints = compute("plan", files, request, job.watch)["joints"]
        purposes = [PURPOSE_CALIBRATE] * len(joints)
    with job.database.write() as session:
        job.queue.hold_fence(session, job.claim)
        store_plan(session, session.get_one(CampaignRow, job.campaign), joints, purposes)


def model_to_verify(session: Session, row: CampaignRow) -> bytes:
    """Return the model.yaml that a verification is about."""
    parameters = session.get_one(ParametersRow, (row.cell, row.parameters_version))
    return yaml.safe_dump(parameters.document["model"], sort_keys=False).encode()


def _alternate(targets: Json) -> tuple[list[list[float]], list[str]]:
    """Put each target's nominal joints before its compensated ones: drift hits both alike."""
    pairs = zip(targets["nominal"], targets["compensated"], strict=True)
    joints = [q for pair in pairs for q in pair]
    return joints, [PURPOSE_NOMINAL, PURPOSE_COMPENSATED] * (len(joints) // 2)
