"""The poses of a campaign, computed once and stored before anything moves."""

import json

import yaml
from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from service.campaigns.models import CampaignKind
from service.campaigns.poses import add_poses
from service.campaigns.store import PURPOSE_CALIBRATE
from service.db.models import CampaignRow, ParametersRow, PoseRow
from service.procedures.computation import Json, compute
from service.procedures.job import Job

MODEL, CELL = "model.yaml", "cell.json"
PURPOSE_NOMINAL, PURPOSE_COMPENSATED = "nominal", "compensated"
PURPOSE_HEALTH = "health"


def ensure_plan(job: Job) -> None:
    """Plan the campaign's poses unless that was done before."""
    with job.database.read() as session:
        row = session.get_one(CampaignRow, job.campaign)
        if session.scalar(select(exists().where(PoseRow.campaign == row.id))):
            return
        kind = CampaignKind(row.kind)
        files = {
            "robot.yaml": row.robot_yaml.encode(),
            CELL: json.dumps(row.cell_document).encode(),
        }
        request: Json = {"count": row.pose_count, "seed": row.seed}
        if kind in {CampaignKind.verify, CampaignKind.health}:
            files[MODEL] = model_to_verify(session, row)
            request["payload_kg"] = row.payload_kg
    if kind is CampaignKind.verify:
        joints, purposes = _alternate(compute("plan_verify", files, request, job.watch))
    elif kind is CampaignKind.health:
        joints = compute("plan_health", files, request, job.watch)["joints"]
        purposes = [PURPOSE_HEALTH] * len(joints)
    else:
        joints = compute("plan", files, request, job.watch)["joints"]
        purposes = [PURPOSE_CALIBRATE] * len(joints)
    with job.database.write() as session:
        job.queue.hold_fence(session, job.claim)
        add_poses(session, session.get_one(CampaignRow, job.campaign), joints, purposes)


def model_to_verify(session: Session, row: CampaignRow) -> bytes:
    """Return the model.yaml that a verification or a health check is about."""
    parameters = session.get_one(ParametersRow, (row.cell, row.parameters_version))
    return yaml.safe_dump(parameters.document["model"], sort_keys=False).encode()


def _alternate(targets: Json) -> tuple[list[list[float]], list[str]]:
    """Put each target's nominal joints before its compensated ones: drift hits both alike."""
    pairs = zip(targets["nominal"], targets["compensated"], strict=True)
    joints = [q for pair in pairs for q in pair]
    return joints, [PURPOSE_NOMINAL, PURPOSE_COMPENSATED] * (len(joints) // 2)
