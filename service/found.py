"""What a program finds unfinished when it starts: said in the log, so that nobody has to guess."""

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.campaigns.models import CampaignState
from service.db.models import CampaignRow, JobRow, PoseRow, ReadingRow
from service.jobs.queue import JobQueue


def unfinished(session: Session, queue: JobQueue) -> list[str]:
    """One sentence for every campaign that somebody has still to bring to its end."""
    open_states = (CampaignState.queued, CampaignState.running, CampaignState.paused)
    rows = session.scalars(
        select(CampaignRow).where(CampaignRow.state.in_(open_states)).order_by(CampaignRow.id)
    )
    return [_sentence(session, queue, row) for row in rows]


def _sentence(session: Session, queue: JobQueue, row: CampaignRow) -> str:
    readings = session.scalar(
        select(func.count()).select_from(ReadingRow).where(ReadingRow.campaign == row.id)
    )
    place = "an import" if row.cell is None else f"cell '{row.cell}'"
    stored = f"campaign {row.id} ({place}) is {row.state} with {readings} readings stored"
    if row.state == CampaignState.paused:
        return f"{stored}; it waits for a person: {row.reason}"
    if queue.is_worked_on(session, row.id):
        return f"{stored}; a live worker has it"
    job = session.scalars(
        select(JobRow).where(JobRow.campaign == row.id, JobRow.state.in_(("queued", "running")))
    ).first()
    if job is None or job.state == "queued":
        return f"{stored}; it waits for a worker"
    in_doubt = _pose_in_doubt(session, row.id)
    again = "" if in_doubt is None else f", and drives to pose {in_doubt} again"
    return f"{stored}; its worker {job.worker} is silent, the next one goes on{again}"


def _pose_in_doubt(session: Session, campaign: int) -> int | None:
    """Return the pose to which the robot was sent without a reading for it."""
    taken = (
        select(func.coalesce(func.max(ReadingRow.attempt), 0))
        .where(ReadingRow.campaign == campaign, ReadingRow.idx == PoseRow.idx)
        .scalar_subquery()
    )
    return session.scalars(
        select(PoseRow.idx)
        .where(PoseRow.campaign == campaign, PoseRow.state == "planned", PoseRow.attempt > taken)
        .limit(1)
    ).first()
