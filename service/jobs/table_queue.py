"""The job queue as a table beside the campaigns: for one host.

Leases run on the host's monotonic clock, which nobody can set and which all processes share. It
starts anew with the machine: a lease that ends later than any lease given now can end was given
before that, and its worker is gone.
"""

import time
from dataclasses import dataclass

from sqlalchemy import ColumnElement, and_, delete, exists, func, or_, select
from sqlalchemy.orm import InstrumentedAttribute, Session, aliased

from service.db.engine import Database
from service.db.models import Document, JobRow, WorkerRow
from service.jobs import job_rows
from service.jobs.queue import Claim, JobEnd, JobKind

_SIGNS_PER_LEASE = 4


@dataclass(frozen=True)
class TableQueue:
    """Jobs in the table `job`."""

    database: Database
    lease_s: float

    def enqueue(
        self,
        session: Session,
        campaign: int,
        cell: str | None,
        kind: JobKind,
        request: Document | None = None,
    ) -> int:
        """Add a job."""
        return job_rows.add_job(session, campaign, cell, kind, request).id

    def claim(self, worker: str) -> Claim | None:
        """Take the oldest job whose worker is silent, or that waits and whose cell is free."""
        with self.database.read() as session:
            row = session.get(WorkerRow, worker)
            sign_due = row is None or not (
                0 <= time.monotonic() - row.heard < self.lease_s / _SIGNS_PER_LEASE
            )
            if not sign_due and self._next_job(session) is None:
                return None
        with self.database.write() as session:
            self._give_sign(session, worker)
            job = self._next_job(session)
            if job is None:
                return None
            job.lease_until = time.monotonic() + self.lease_s
            return job_rows.take_job(job, worker, job.lease_until)

    def renew(self, claim: Claim) -> float:
        """Move the end of the lease."""
        with self.database.write() as session:
            job = job_rows.own_job(session, claim)
            self._give_sign(session, job.worker)
            job.lease_until = time.monotonic() + self.lease_s
            return job.lease_until

    def hold_fence(self, session: Session, claim: Claim) -> None:
        """Compare the fence."""
        job_rows.own_job(session, claim)

    def end(self, session: Session, claim: Claim, end: JobEnd, reason: str) -> None:
        """Let go of a job."""
        job_rows.let_go(job_rows.own_job(session, claim), end, reason)

    def is_worked_on(self, session: Session, campaign: int) -> bool:
        """Whether a job runs under a lease that still holds."""
        held = and_(
            JobRow.campaign == campaign,
            JobRow.state == "running",
            self._is_ahead(JobRow.lease_until),
        )
        return session.scalar(select(exists().where(held))) is True

    def is_driven(self, session: Session, cell: str | None) -> bool:
        """Whether a collecting job is in a worker's hands."""
        return job_rows.is_driven(session, cell)

    def requeue_held(self, session: Session, campaign: int) -> None:
        """Put the held job back."""
        for row in job_rows.held_jobs(session, campaign):
            row.state = "queued"

    def withdraw(self, session: Session, campaign: int, end: JobEnd) -> None:
        """End all open jobs."""
        job_rows.withdraw_jobs(session, campaign, end)

    def live_workers(self, session: Session) -> int:
        """Count the workers heard of within a lease."""
        live = self._is_ahead(WorkerRow.heard + self.lease_s)
        return session.scalar(select(func.count()).select_from(WorkerRow).where(live)) or 0

    def leave(self, worker: str) -> None:
        """Forget a worker."""
        with self.database.write() as session:
            session.execute(delete(WorkerRow).where(WorkerRow.name == worker))

    def _give_sign(self, session: Session, worker: str) -> None:
        live = self._is_ahead(WorkerRow.heard + self.lease_s)
        session.execute(delete(WorkerRow).where(~live, WorkerRow.name != worker))
        session.merge(WorkerRow(name=worker, heard=time.monotonic()))

    def _is_ahead(
        self, moment: InstrumentedAttribute[float] | ColumnElement[float]
    ) -> ColumnElement[bool]:
        now = time.monotonic()
        return moment.between(now, now + self.lease_s)

    def _next_job(self, session: Session) -> JobRow | None:
        other = aliased(JobRow)
        cell_is_busy = exists().where(other.cell == JobRow.cell, other.state == "running")
        silent = (JobRow.state == "running") & ~self._is_ahead(JobRow.lease_until)
        waiting = (JobRow.state == "queued") & ~cell_is_busy
        return session.scalars(
            select(JobRow).where(or_(silent, waiting)).order_by(JobRow.id).limit(1)
        ).first()
