"""The job queue for several hosts: Procrastinate on PostgreSQL brings jobs to workers.

The table `job` stays the truth about a job; Procrastinate says which worker gets it, that a cell
has one job at a time (its `lock`), that a job is queued once (its `queueing_lock`), and which
worker has fallen silent, all on the server's clock. Both are changed in one transaction.
"""

import time
from datetime import UTC, datetime

from procrastinate.jobs import Job as Delivery
from procrastinate.jobs import Status
from sqlalchemy import text
from sqlalchemy.orm import Session

from service.db.engine import Database
from service.db.models import Document, JobRow
from service.jobs import job_rows
from service.jobs.queue import Claim, JobEnd, JobKind
from service.jobs.session_connector import answer_of, procrastinate

_QUEUE = "robocal"
_TASK = "robocal.job"
_SIGNS_PER_LEASE = 4
_AT_ONCE = datetime.fromtimestamp(0, UTC)
_FORGOTTEN_LEASES = 100
"""A worker silent for so many leases is struck off the list."""

_LIVE = "last_heartbeat >= now() - make_interval(secs => :lease_s)"
_HEARD_OF = text("SELECT count(*) FROM procrastinate_workers WHERE id = :holder")
_LIVE_WORKERS = text(f"SELECT count(*) FROM procrastinate_workers WHERE {_LIVE}")
_WORKED_ON = text(
    "SELECT EXISTS (SELECT FROM job JOIN procrastinate_jobs d ON d.id = job.delivery "
    "JOIN procrastinate_workers w ON w.id = d.worker_id WHERE job.campaign = :campaign "
    f"AND job.state = 'running' AND d.status = 'doing' AND w.{_LIVE})"
)
_SOMETHING_TO_DO = text(
    "SELECT EXISTS (SELECT FROM procrastinate_jobs d "
    "LEFT JOIN procrastinate_workers w ON w.id = d.worker_id WHERE d.status = 'todo' "
    f"OR d.status = 'doing' AND (w.id IS NULL OR NOT w.{_LIVE}))"
)
# After the server's clock was set back, a dead worker's latest sign lies in the future.
_NO_SIGN_FROM_THE_FUTURE = text(
    "UPDATE procrastinate_workers SET last_heartbeat = now() WHERE last_heartbeat > now()"
)


class ProcrastinateQueue:
    """Jobs on PostgreSQL; one object in a worker's process stands for that worker."""

    def __init__(self, database: Database, lease_s: float) -> None:
        self._database = database
        self._lease_s = lease_s
        self._holder: int | None = None
        self._next_sign = 0.0

    def enqueue(
        self,
        session: Session,
        campaign: int,
        cell: str | None,
        kind: JobKind,
        request: Document | None = None,
    ) -> int:
        """Add a job."""
        row = job_rows.add_job(session, campaign, cell, kind, request)
        _send(session, row)
        return row.id

    def claim(self, worker: str) -> Claim | None:
        """Take the next job, after those of silent workers were put back."""
        holder = self._registered()
        with self._database.read() as session:
            if not session.scalar(_SOMETHING_TO_DO, {"lease_s": self._lease_s}):
                return None
        lease_until = time.monotonic() + self._lease_s
        with self._database.write() as session:
            self._put_back_stalled(session)
            queue = procrastinate(session)
            answer_of(queue.update_heartbeat(holder))
            delivery = answer_of(queue.fetch_job([_QUEUE], holder))
            if delivery is None:
                return None
            row = session.get_one(JobRow, delivery.task_kwargs["job"])
            return job_rows.take_job(row, worker, lease_until)

    def renew(self, claim: Claim) -> float:
        """Give a sign of life, if the job is still this worker's."""
        lease_until = time.monotonic() + self._lease_s
        with self._database.write() as session:
            job_rows.own_job(session, claim)
            self._give_sign(session)
        return lease_until

    def hold_fence(self, session: Session, claim: Claim) -> None:
        """Compare the fence."""
        job_rows.own_job(session, claim)

    def end(self, session: Session, claim: Claim, end: JobEnd, reason: str) -> None:
        """Let go of a job."""
        row = job_rows.own_job(session, claim)
        job_rows.let_go(row, end, reason)
        assert row.delivery is not None
        if end is JobEnd.queued:
            procrastinate(session).retry_job_by_id(row.delivery, _AT_ONCE)
        else:
            _close(session, row.delivery)
            row.delivery = None

    def is_worked_on(self, session: Session, campaign: int) -> bool:
        """Whether a worker that still gives signs of life runs a job of the campaign."""
        known = {"campaign": campaign, "lease_s": self._lease_s}
        return session.scalar(_WORKED_ON, known) is True

    def is_driven(self, session: Session, cell: str | None) -> bool:
        """Whether a collecting job is in a worker's hands."""
        return job_rows.is_driven(session, cell)

    def requeue_held(self, session: Session, campaign: int) -> None:
        """Send the held job out again."""
        for row in job_rows.held_jobs(session, campaign):
            row.state = "queued"
            _send(session, row)

    def withdraw(self, session: Session, campaign: int, end: JobEnd) -> None:
        """End all open jobs."""
        for delivery in job_rows.open_deliveries(session, campaign):
            _close(session, delivery)
        job_rows.withdraw_jobs(session, campaign, end)

    def live_workers(self, session: Session) -> int:
        """Count the workers heard of within a lease."""
        return session.scalar(_LIVE_WORKERS, {"lease_s": self._lease_s}) or 0

    def leave(self, worker: str) -> None:
        """Strike this worker off the list."""
        if self._holder is not None:
            with self._database.write() as session:
                answer_of(procrastinate(session).unregister_worker(self._holder))

    def send_open_jobs(self, session: Session) -> None:
        """Bring all open jobs of a database that was copied here into the queue."""
        for row in job_rows.unsent_jobs(session):
            row.state = "queued"
            row.worker = ""
            _send(session, row)

    def _registered(self) -> int:
        """Return this worker's number, known to the server and heard of lately."""
        if self._holder is not None and time.monotonic() < self._next_sign:
            return self._holder
        with self._database.write() as session:
            if not session.scalar(_HEARD_OF, {"holder": self._holder}):
                self._holder = answer_of(procrastinate(session).register_worker())
            self._give_sign(session)
        assert self._holder is not None
        return self._holder

    def _give_sign(self, session: Session) -> None:
        assert self._holder is not None
        answer_of(procrastinate(session).update_heartbeat(self._holder))
        self._next_sign = time.monotonic() + self._lease_s / _SIGNS_PER_LEASE

    def _put_back_stalled(self, session: Session) -> None:
        session.execute(_NO_SIGN_FROM_THE_FUTURE)
        queue = procrastinate(session)
        # By the queue alone: asking by the lock finds jobs of other cells as well.
        stalled = answer_of(
            queue.get_stalled_jobs(queue=_QUEUE, seconds_since_heartbeat=self._lease_s)
        )
        for delivery in stalled:
            assert delivery.id is not None
            queue.retry_job_by_id(delivery.id, _AT_ONCE)
            session.get_one(JobRow, delivery.task_kwargs["job"]).state = "queued"
        answer_of(queue.prune_stalled_workers(self._lease_s * _FORGOTTEN_LEASES))
        session.flush()


def _send(session: Session, row: JobRow) -> None:
    sent = procrastinate(session).defer_job(
        Delivery(
            queue=_QUEUE,
            lock=row.cell,
            queueing_lock=str(row.id),
            task_name=_TASK,
            task_kwargs={"job": row.id},
        )
    )
    row.delivery = sent.id
    session.flush()


def _close(session: Session, delivery: int) -> None:
    """Delete a delivery: the job's own row keeps how it ended."""
    queue = procrastinate(session)
    answer_of(queue.finish_job_by_id_async(delivery, Status.SUCCEEDED, delete_job=True))
