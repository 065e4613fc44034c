"""The life of a campaign: which state follows which, and why. Every change is a new revision.

Each function works in the caller's transaction. What a worker does passes the fence of its job;
what a person does takes effect at once where no live worker holds the campaign, and otherwise
becomes a wish that the worker sees within a twentieth of a second.
"""

from dataclasses import dataclass

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service.campaigns.models import ENDED, CampaignKind, CampaignState
from service.clock import utc_now
from service.db.models import CampaignRow, CellRow, PoseRow
from service.errors import Conflict, NotFound
from service.jobs.queue import Claim, JobEnd, JobKind, JobQueue
from service.jobs.watch import Cause
from service.webhooks.models import WebhookEvent
from service.webhooks.outbox import announce


def find(session: Session, number: int) -> CampaignRow:
    """Return the row of a campaign; raises `NotFound`."""
    row = session.get(CampaignRow, number)
    if row is None:
        raise NotFound(f"There is no campaign {number}.")
    return row


@dataclass(frozen=True)
class WorkersSide:
    """What the worker that holds the job may do with the campaign."""

    queue: JobQueue
    claim: Claim

    def start(self, session: Session) -> None:
        """Note that the worker has begun."""
        row = self._row(session)
        row.started = row.started or utc_now()
        _enter(row, CampaignState.running)

    def stop(self, session: Session, cause: Cause) -> None:
        """Stop as the job was told to."""
        if cause is Cause.abort or self._is_to_be_aborted(session):
            self._end(session, CampaignState.aborted, JobEnd.cancelled, "aborted by a person")
        elif cause is Cause.pause:
            self._leave(session, CampaignState.paused, JobEnd.held, "paused by a person")
        elif cause is Cause.disarmed:
            reason = f"cell '{self.claim.cell}' was disarmed; arm it and resume"
            self._leave(session, CampaignState.paused, JobEnd.held, reason)
        else:
            self._leave(session, CampaignState.queued, JobEnd.queued, "waits for a worker")

    def hold(self, session: Session, reason: str) -> None:
        """Wait for a person whom a device needs; resumed, it goes on at the same pose."""
        if self._is_to_be_aborted(session):
            self.stop(session, Cause.abort)
        else:
            self._leave(session, CampaignState.paused, JobEnd.held, reason)

    def fail(self, session: Session, reason: str) -> None:
        """End a campaign that cannot go on."""
        self._end(session, CampaignState.failed, JobEnd.failed, reason)

    def finish_collecting(self, session: Session) -> None:
        """End the motion after the last reading; the numbers follow."""
        row = self._row(session)
        self.queue.end(session, self.claim, JobEnd.done, "")
        self.queue.enqueue(session, row.id, row.cell, JobKind.analyse)
        # A follow-up may ask for more poses; it is over, and disarmed, when the cause is named.
        if row.kind != CampaignKind.follow_up:
            _disarm(session, row.cell)

    def go_on(self, session: Session, kind: JobKind) -> None:
        """End this job and queue the campaign's next one."""
        row = self._row(session)
        self.queue.end(session, self.claim, JobEnd.done, "")
        self.queue.enqueue(session, row.id, row.cell, kind)
        advance(row)

    def finish(self, session: Session, reason: str = "") -> None:
        """All results are stored; the reason says what could not be computed."""
        self._end(session, CampaignState.finished, JobEnd.done, reason)

    def wished_stop(self, session: Session) -> Cause | None:
        """Whether a person wants the job to stop."""
        row = session.get_one(CampaignRow, self.claim.campaign)
        if row.wish:
            return Cause(row.wish)
        if self.claim.kind is JobKind.collect and not is_armed(session, row.cell):
            return Cause.disarmed
        return None

    def _is_to_be_aborted(self, session: Session) -> bool:
        # Of all wishes this one is final, whatever else stopped the job first.
        return self._row(session).wish == Cause.abort

    def _row(self, session: Session) -> CampaignRow:
        self.queue.hold_fence(session, self.claim)
        return session.get_one(CampaignRow, self.claim.campaign)

    def _leave(self, session: Session, state: CampaignState, end: JobEnd, reason: str) -> None:
        row = self._row(session)
        self.queue.end(session, self.claim, end, reason)
        _enter(row, state, reason)

    def _end(self, session: Session, state: CampaignState, end: JobEnd, reason: str) -> None:
        self._leave(session, state, end, reason)
        row = session.get_one(CampaignRow, self.claim.campaign)
        _close(session, row)
        if self.claim.kind is JobKind.collect or row.kind == CampaignKind.follow_up:
            _disarm(session, row.cell)


def pause(session: Session, queue: JobQueue, number: int) -> CampaignRow:
    """Stop the robot for now, as a person wishes."""
    row = find(session, number)
    _require(row, "pause", {CampaignState.queued, CampaignState.running})
    if row.wish == Cause.abort:
        raise Conflict(f"Campaign {number} is being aborted; it cannot be paused any more.")
    if queue.is_worked_on(session, number):
        row.wish = Cause.pause
        advance(row)
        return row
    queue.withdraw(session, number, JobEnd.held)
    _enter(row, CampaignState.paused, "paused by a person")
    return row


def resume(session: Session, queue: JobQueue, number: int, *, skip_pose: bool) -> CampaignRow:
    """Let a paused campaign go on at the next unmeasured pose."""
    row = find(session, number)
    _require(row, "resume", {CampaignState.paused})
    if row.cell is not None and not is_armed(session, row.cell) and open_pose(session, number):
        raise Conflict(not_armed(row.cell))
    if skip_pose:
        _skip(session, number)
    queue.requeue_held(session, number)
    _enter(row, CampaignState.queued)
    return row


def abort(session: Session, queue: JobQueue, number: int, *, is_told: bool = False) -> CampaignRow:
    """End the campaign; what was measured stays.

    Its worker may be told already (`StopFlag`), and have ended it before this transaction's turn.
    """
    row = find(session, number)
    if is_told and row.state == CampaignState.aborted:
        return row
    _require(row, "abort", set(CampaignState) - ENDED)
    if queue.is_worked_on(session, number):
        row.wish = Cause.abort
        advance(row)
        return row
    queue.withdraw(session, number, JobEnd.cancelled)
    _enter(row, CampaignState.aborted, "aborted by a person")
    _close(session, row)
    # The operator's leave is the cell's, and another campaign may be moving under it.
    if not queue.is_driven(session, row.cell):
        _disarm(session, row.cell)
    return row


def open_pose(session: Session, number: int) -> PoseRow | None:
    """Return the first pose that is still to be measured."""
    return session.scalars(
        select(PoseRow)
        .where(PoseRow.campaign == number, PoseRow.state == "planned")
        .order_by(PoseRow.idx)
        .limit(1)
    ).first()


def is_armed(session: Session, cell: str | None) -> bool:
    """Whether an operator allows motion."""
    return session.scalar(select(CellRow.armed).where(CellRow.name == cell)) is True


def not_armed(cell: str) -> str:
    """Return the sentence for a cell in which nothing may move."""
    return (
        f"Cell '{cell}' is not armed: go and look that nobody is inside and nothing in the way, "
        "then arm the cell first."
    )


def advance(row: CampaignRow) -> int:
    """Count a change, so that watchers see it; the new revision."""
    row.revision += 1
    return row.revision


def _enter(row: CampaignRow, state: CampaignState, reason: str = "") -> None:
    row.state = state
    row.reason = reason
    # A wish outlives a worker that died before it saw it, but not the state that it asked for.
    if state not in {CampaignState.running, CampaignState.queued}:
        row.wish = ""
    advance(row)


def _close(session: Session, row: CampaignRow) -> None:
    """Note the end, and tell those who want to hear of it."""
    row.finished = utc_now()
    content = {"id": row.id, "kind": row.kind, "state": row.state, "reason": row.reason}
    announce(session, WebhookEvent.campaign_finished, row.cell, {"campaign": content})


def _disarm(session: Session, cell: str | None) -> None:
    session.execute(update(CellRow).where(CellRow.name == cell).values(armed=False))


def _skip(session: Session, number: int) -> None:
    pose = open_pose(session, number)
    if pose is None:
        raise Conflict(f"Campaign {number} has no pose left to skip.")
    pose.state, pose.reason = "skipped", "left out by a person"


def _require(row: CampaignRow, action: str, states: set[CampaignState]) -> None:
    if row.state not in states:
        raise Conflict(
            f"Campaign {row.id} is {row.state}; only a campaign that is "
            f"{' or '.join(sorted(states))} can be told to {action}."
        )
