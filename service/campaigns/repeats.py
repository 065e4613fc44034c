"""Computing a campaign that has ended once more, with other settings; its state stays as it is."""

from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.campaigns import life
from service.campaigns.models import (
    ENDED,
    Computation,
    IdentificationWish,
    Repeatable,
)
from service.db.models import CampaignRow, Document, JobRow
from service.errors import Conflict, NotFound
from service.jobs.queue import Claim, JobEnd, JobKind, JobQueue
from service.jobs.watch import Cause

_OPEN = ("queued", "running")


@dataclass(frozen=True)
class RepeatSide:
    """What a worker does with a repeated computation: the job ends, the campaign does not move."""

    queue: JobQueue
    claim: Claim

    def start(self, session: Session) -> None:
        """Note that the worker has begun."""
        self.queue.hold_fence(session, self.claim)

    def stop(self, session: Session, cause: Cause) -> None:
        """Give it back; another worker starts it anew."""
        self.queue.end(session, self.claim, JobEnd.queued, "waits for a worker")

    def hold(self, session: Session, reason: str) -> None:
        """Nothing waits for a person here."""
        self.fail(session, reason)

    def fail(self, session: Session, reason: str) -> None:
        """There is no answer; the results before stay."""
        self.queue.end(session, self.claim, JobEnd.failed, reason)

    def finish(self, session: Session) -> None:
        """The new result is stored; watchers see a new revision."""
        self.queue.end(session, self.claim, JobEnd.done, "")
        life.advance(session.get_one(CampaignRow, self.claim.campaign))

    def wished_stop(self, session: Session) -> Cause | None:
        """Whether it was cancelled."""
        row = session.get_one(JobRow, self.claim.job)
        return None if row.state == "running" else Cause.lease_lost


def ask_identification(
    session: Session, queue: JobQueue, campaign: int, wish: IdentificationWish
) -> Computation:
    """Queue an identification with these settings."""
    return _ask(session, queue, campaign, Repeatable.identification, wish.model_dump(mode="json"))


def ask_diagnosis(session: Session, queue: JobQueue, campaign: int) -> Computation:
    """Queue a diagnosis of all that was measured."""
    return _ask(session, queue, campaign, Repeatable.diagnosis, {})


def shown(session: Session, campaign: int, number: int) -> Computation:
    """Show one computation; raises `NotFound`."""
    row = session.get(JobRow, number)
    if row is None or row.campaign != campaign or row.kind != JobKind.repeat:
        raise NotFound(f"Campaign {campaign} has no repeated computation {number}.")
    return _computation(row)


def cancel(session: Session, queue: JobQueue, campaign: int, number: int) -> Computation:
    """End a computation; the results before stay."""
    if shown(session, campaign, number).state not in _OPEN:
        raise Conflict(f"Computation {number} of campaign {campaign} has ended already.")
    queue.withdraw(session, campaign, JobEnd.cancelled)
    session.expire_all()
    return shown(session, campaign, number)


def _ask(
    session: Session, queue: JobQueue, campaign: int, result: Repeatable, settings: Document
) -> Computation:
    row = life.find(session, campaign)
    if row.state not in ENDED:
        raise Conflict(f"Campaign {campaign} is {row.state}; it is computed when all is measured.")
    if row.kind not in {"calibrate", "follow_up"}:
        raise Conflict(f"Campaign {campaign} is a {row.kind}; only calibrations are identified.")
    waiting = select(JobRow.id).where(JobRow.campaign == campaign, JobRow.state.in_(_OPEN))
    if (other := session.scalar(waiting)) is not None:
        raise Conflict(f"Computation {other} of campaign {campaign} is still under way.")
    request = {"result": result.value, "settings": settings}
    number = queue.enqueue(session, campaign, None, JobKind.repeat, request)
    return _computation(session.get_one(JobRow, number))


def _computation(row: JobRow) -> Computation:
    assert row.request is not None
    return Computation(
        id=row.id,
        campaign=row.campaign,
        result=Repeatable(row.request["result"]),
        settings=row.request["settings"],
        state=row.state,
        reason=row.reason,
        created=row.created,
        finished=row.finished,
    )
