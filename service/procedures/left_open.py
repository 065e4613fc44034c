"""What to say when the poses that were measured do not allow an answer."""

from collections import Counter

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.campaigns.models import CampaignKind
from service.db.models import CampaignRow, PoseRow, ReadingRow
from service.procedures.computation import compute
from service.procedures.job import Job

_MOST_REASONS = 3


def said_of_poses(job: Job) -> str:
    """Sentences about skipped poses and what the others leave open; empty where neither is so."""
    with job.database.read() as session:
        row = session.get_one(CampaignRow, job.campaign)
        skipped = _skipped(session, row.id)
        if row.kind != CampaignKind.calibrate or not row.robot_yaml:
            return skipped
        files = {"robot.yaml": row.robot_yaml.encode()}
        readings = session.scalars(select(ReadingRow).where(ReadingRow.campaign == row.id)).all()
        request = {
            "joints": [reading.joints for reading in readings],
            "sees_orientation": any(reading.orientation is not None for reading in readings),
        }
    names = compute("left_open", files, request, job.watch)["open"]
    if not names:
        return skipped
    return f"{skipped}; the measured poses cannot identify {', '.join(names)}"


def _skipped(session: Session, campaign: int) -> str:
    poses = session.scalars(select(PoseRow).where(PoseRow.campaign == campaign)).all()
    reasons = Counter(pose.reason for pose in poses if pose.state == "skipped")
    if not reasons:
        return ""
    first = "; ".join(
        f"{count} because: {reason}" for reason, count in reasons.most_common(_MOST_REASONS)
    )
    return f"; {reasons.total()} of {len(poses)} poses were skipped, {first}"
