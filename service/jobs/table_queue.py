"""The job queue as a table beside the campaigns: for one host."""

import time
from dataclasses import dataclass

from sqlalchemy import exists, or_, select, update
from sqlalchemy.orm import Session, aliased

from service.clock import utc_now
from service.db.engine import Database
from service.db.models import JobRow
from service.jobs.queue import Claim, JobEnd, JobKind, LeaseLost

_OPEN = ("queued", "running", "held")


@dataclass(frozen=True)
class TableQueue:
    """Jobs in the table `job`; the lease runs on the host's clock."""

    database: Database
    lease_s: float

    def enqueue(self, session: Session, campaign: int, cell: str | None, kind: JobKind) -> None:
        """Add a job."""
        session.add(
            JobRow(campaign=campaign, cell=cell, kind=kind, state="queued", created=utc_now())
        )
        session.flush()

    def claim(self, worker: str) -> Claim | None:
        """Take the oldest job whose worker is silent, or that waits and whose cell is free."""
        with self.database.read() as session:
            if _next_job(session) is None:
                return None
        with self.database.write() as session:
            job = _next_job(session)
            if job is None:
                return None
            job.state = "running"
            job.fence += 1
            job.lease_until = time.time() + self.lease_s
            job.worker = worker
            return Claim(
                job=job.id,
                campaign=job.campaign,
                cell=job.cell,
                kind=JobKind(job.kind),
                fence=job.fence,
                lease_until=job.lease_until,
            )

    def renew(self, claim: Claim) -> float:
        """Move the end of the lease."""
        with self.database.write() as session:
            job = _own_job(session, claim)
            job.lease_until = time.time() + self.lease_s
            return job.lease_until

    def hold_fence(self, session: Session, claim: Claim) -> None:
        """Compare the fence."""
        _own_job(session, claim)

    def end(self, session: Session, claim: Claim, end: JobEnd, reason: str) -> None:
        """Let go of a job."""
        job = _own_job(session, claim)
        job.state = end
        job.reason = reason
        job.lease_until = 0.0
        job.worker = ""
        if end not in _OPEN:
            job.finished = utc_now()

    def is_worked_on(self, session: Session, campaign: int) -> bool:
        """Whether a job runs under a lease that still holds."""
        return (
            session.scalar(
                select(
                    exists().where(
                        JobRow.campaign == campaign,
                        JobRow.state == "running",
                        JobRow.lease_until >= time.time(),
                    )
                )
            )
            is True
        )

    def is_driven(self, session: Session, cell: str | None) -> bool:
        """Whether a collecting job is in a worker's hands."""
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

    def requeue_held(self, session: Session, campaign: int) -> None:
        """Put the held job back."""
        session.execute(
            update(JobRow)
            .where(JobRow.campaign == campaign, JobRow.state == "held")
            .values(state="queued")
        )

    def withdraw(self, session: Session, campaign: int, end: JobEnd) -> None:
        """End all open jobs; the raised fence shuts out a worker that only seemed dead."""
        session.execute(
            update(JobRow)
            .where(JobRow.campaign == campaign, JobRow.state.in_(_OPEN))
            .values(state=end, fence=JobRow.fence + 1, lease_until=0.0, worker="")
        )


def _next_job(session: Session) -> JobRow | None:
    other = aliased(JobRow)
    cell_is_busy = exists().where(other.cell == JobRow.cell, other.state == "running")
    silent = (JobRow.state == "running") & (JobRow.lease_until < time.time())
    waiting = (JobRow.state == "queued") & ~cell_is_busy
    return session.scalars(
        select(JobRow).where(or_(silent, waiting)).order_by(JobRow.id).limit(1)
    ).first()


def _own_job(session: Session, claim: Claim) -> JobRow:
    job = session.get_one(JobRow, claim.job)
    if job.state != "running" or job.fence != claim.fence:
        raise LeaseLost(f"job {claim.job} is no longer this worker's")
    return job
