"""Server-sent events of a campaign, read from the database so that any process can serve them.

The id of an event is the campaign's revision. A client that comes back with Last-Event-ID gets
every reading accepted since, then the present state; one that has seen the end gets 204, at
which a browser stops coming back. In between, without an id, comes where the arm is.
"""

import json
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass

import anyio
from sqlalchemy import select
from sqlalchemy.orm import Session

from service.campaigns import life, store
from service.campaigns.arm_now import arm_now
from service.campaigns.models import ENDED, Campaign, CampaignState
from service.db.engine import Database
from service.db.models import PoseRow, ReadingRow

HEARTBEAT = ": still here\n\n"


@dataclass(frozen=True)
class Look:
    """What happened in a campaign after a revision."""

    campaign: Campaign
    readings: tuple[str, ...]
    arm: str | None
    """Where the arm is, as the data of an event; None where nobody saw it, or its work is done."""

    @property
    def ended(self) -> bool:
        """Whether nothing more will happen."""
        return self.campaign.state in ENDED

    def text(self) -> str:
        """As server-sent events."""
        state = _event("progress", self.campaign.revision, self.campaign.model_dump_json())
        return "".join((*self.readings, state))


def look(database: Database, number: int, since: int) -> Look:
    """Everything after revision `since`."""
    with database.read() as session:
        row = life.find(session, number)
        shown = store.shown(session, row)
        # Of an aborted campaign it still tells where the arm was left standing.
        finished = shown.state is CampaignState.finished
        arm = None if finished else arm_now(session, row)
        return Look(shown, tuple(_readings(session, number, since)), arm)


async def stream(
    look_after: Callable[[int, int], Awaitable[Look]],
    number: int,
    since: int,
    *,
    poll_s: float,
    heartbeat_s: float,
) -> AsyncIterator[str]:
    """Events until the campaign ends or the client goes; `look_after` may be shared by pages."""
    silent_since = time.monotonic()
    arm = None
    while True:
        seen = await look_after(number, since)
        if seen.arm not in (None, arm):
            arm = seen.arm
            silent_since = time.monotonic()
            yield f"event: arm\ndata: {arm}\n\n"
        if seen.campaign.revision > since:
            since = seen.campaign.revision
            silent_since = time.monotonic()
            yield seen.text()
        if seen.ended:
            return
        if time.monotonic() - silent_since >= heartbeat_s:
            silent_since = time.monotonic()
            yield HEARTBEAT
        await anyio.sleep(poll_s)


def _readings(session: Session, number: int, since: int) -> list[str]:
    rows = session.execute(
        select(ReadingRow, PoseRow.purpose)
        .join(PoseRow, (PoseRow.campaign == ReadingRow.campaign) & (PoseRow.idx == ReadingRow.idx))
        .where(ReadingRow.campaign == number, ReadingRow.revision > since)
        .order_by(ReadingRow.revision)
    )
    return [
        _event("reading", reading.revision, json.dumps(_summary(reading, purpose)))
        for reading, purpose in rows
    ]


def _summary(reading: ReadingRow, purpose: str) -> dict[str, float | str]:
    x, y, z = (round(part * 1e3, 4) for part in reading.position)
    return {
        "pose": reading.idx,
        "repeat": reading.repeat,
        "purpose": purpose,
        "attempt": reading.attempt,
        "x_mm": x,
        "y_mm": y,
        "z_mm": z,
        "spread_mm": round(reading.spread * 1e3, 4),
        "t_s": round(reading.t_s, 3),
    }


def _event(name: str, revision: int, payload: str) -> str:
    return f"id: {revision}\nevent: {name}\ndata: {payload}\n\n"
