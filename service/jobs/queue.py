"""The port between campaigns and whatever keeps the queue.

A job is held under a lease. Every claim raises the job's fence; a worker whose fence is no longer
the newest has lost the job, and every transaction in which it wants to store something says so.
"""

from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Protocol

from sqlalchemy.orm import Session


class JobKind(StrEnum):
    """What a job does."""

    collect = "collect"
    analyse = "analyse"
    diagnose = "diagnose"
    repeat = "repeat"
    """a computation that a person asked for again, of a campaign that has ended"""


class JobEnd(StrEnum):
    """How a job leaves its worker."""

    queued = "queued"
    """given back: the next worker goes on where this one stopped"""
    held = "held"
    """waits for a person to resume the campaign"""
    done = "done"
    failed = "failed"
    cancelled = "cancelled"


@dataclass(frozen=True)
class Claim:
    """One job in the hands of one worker."""

    job: int
    campaign: int
    cell: str | None
    kind: JobKind
    fence: int
    lease_until: float
    """On this host's monotonic clock [s], which nobody can set."""


class LeaseLost(Exception):
    """Another worker has the job, or it was ended meanwhile; nothing may be stored for it."""


class JobQueue(Protocol):
    """Durable jobs: one at a time for a cell, each accepted once."""

    def enqueue(
        self,
        session: Session,
        campaign: int,
        cell: str | None,
        kind: JobKind,
        request: dict[str, Any] | None = None,
    ) -> int:
        """Add a job, in the caller's transaction; its number."""
        ...

    def claim(self, worker: str) -> Claim | None:
        """Take the next job that nobody holds and whose cell is free; None if there is none."""
        ...

    def renew(self, claim: Claim) -> float:
        """Hold on to a job; the new end of the lease. Raises `LeaseLost`."""
        ...

    def hold_fence(self, session: Session, claim: Claim) -> None:
        """Raise `LeaseLost` unless the job is still the caller's, in the caller's transaction."""
        ...

    def end(self, session: Session, claim: Claim, end: JobEnd, reason: str) -> None:
        """Let go of a job, in the caller's transaction. Raises `LeaseLost`."""
        ...

    def is_worked_on(self, session: Session, campaign: int) -> bool:
        """Whether a live worker holds a job of the campaign."""
        ...

    def is_driven(self, session: Session, cell: str | None) -> bool:
        """Whether a job that collects readings runs in the cell, even if its worker is silent."""
        ...

    def requeue_held(self, session: Session, campaign: int) -> None:
        """Put the held job of a campaign back into the queue."""
        ...

    def withdraw(self, session: Session, campaign: int, end: JobEnd) -> None:
        """Take all open jobs of a campaign from the queue and from dead workers' hands."""
        ...

    def live_workers(self, session: Session) -> int:
        """How many workers gave a sign of life within the length of a lease."""
        ...

    def leave(self, worker: str) -> None:
        """Note that a worker ends on purpose."""
        ...
