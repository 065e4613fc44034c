"""What both queues do with the application's own table of jobs, which says what is true."""

from sqlalchemy import exists, select, update
from sqlalchemy.orm import Session

from service.clock import utc_now
from service.db.models import Document, JobRow
from service.jobs.queue import Claim, JobEnd, JobKind, LeaseLost

_OPEN = ("queued", "running", "held")


def add_job(
    session: Session,
    campaign: int,
    cell: str | None,
    kind: JobKind,
    request: Document | None = None,
) -> JobRow:
    """Store a job that waits for a worker."""
    row = JobRow(
        campaign=campaign,
        cell=cell,
        kind=kind,
        state="queued",
        request=request,
        created=utc_now(),
    )
    session.add(row)
    session.flush()
    return row


def take_job(row: JobRow, worker: str, lease_until: float) -> Claim:
    """Put a job into a worker's hands; the raised fence shuts out the one before."""
    row.state = "running"
    row.fence += 1
    row.worker = worker
    return Claim(
        job=row.id,
        campaign=row.campaign,
        cell=row.cell,
        kind=JobKind(row.kind),
        fence=row.fence,
        lease_until=lease_until,
    )


def own_job(session: Session, claim: Claim) -> JobRow:
    """Return the row of a claimed job; raises `LeaseLost` when it is no longer the claimer's."""
    row = session.get_one(JobRow, claim.job)
    if row.state != "running" or row.fence != claim.fence:
        raise LeaseLost(f"job {claim.job} is no longer this worker's")
    return row


def let_go(row: JobRow, end: JobEnd, reason: str) -> None:
    """Take a job out of its worker's hands."""
    row.state = end
    row.reason = reason
    row.lease_until = 0.0
    row.worker = ""
    if end not in _OPEN:
        row.finished = utc_now()


def is_driven(session: Session, cell: str | None) -> bool:
    """Whether a collecting job of the cell is in a worker's hands."""
    return (
        session.scalar(
            select(
                exists().where(
                    JobRow.cell == cell,
                    JobRow.kind == JobKind.collect,
                    JobRow.state == "running",
                )
            )
        )
        is True
    )


def held_jobs(session: Session, campaign: int) -> list[JobRow]:
    """Jobs of a campaign that wait for a person."""
    return list(
        session.scalars(select(JobRow).where(JobRow.campaign == campaign, JobRow.state == "held"))
    )


def open_deliveries(session: Session, campaign: int) -> list[int]:
    """Procrastinate's numbers of the open jobs of a campaign."""
    mine = JobRow.campaign == campaign, JobRow.state.in_(_OPEN)
    found = session.scalars(select(JobRow.delivery).where(*mine, JobRow.delivery.is_not(None)))
    return [number for number in found if number is not None]


def unsent_jobs(session: Session) -> list[JobRow]:
    """Jobs that wait or were under way, in their order, and that Procrastinate does not know."""
    waiting = JobRow.state.in_(("queued", "running")), JobRow.delivery.is_(None)
    return list(session.scalars(select(JobRow).where(*waiting).order_by(JobRow.id)))


def withdraw_jobs(session: Session, campaign: int, end: JobEnd) -> None:
    """End all open jobs; the raised fence shuts out a worker that only seemed dead."""
    session.execute(
        update(JobRow)
        .where(JobRow.campaign == campaign, JobRow.state.in_(_OPEN))
        .values(state=end, fence=JobRow.fence + 1, lease_until=0.0, worker="", delivery=None)
    )
