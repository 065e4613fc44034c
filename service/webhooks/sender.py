"""Deliver the outbox: every worker has one sender; a delivery is taken by one of them at a time.

At least once: a sender that dies between the receiver's answer and its own note sends again, with
the same `Robocal-Delivery`. Nothing of the receiver's answer but its status is kept.
"""

import asyncio
import logging
import time
from dataclasses import dataclass
from threading import Event

import httpx
from sqlalchemy import select, update
from sqlalchemy.exc import DBAPIError

from service.clock import utc_now
from service.db.engine import Database
from service.db.webhook_tables import DeliveryRow, WebhookRow
from service.settings import Settings
from service.webhooks.destination import Destination, Forbidden, destination
from service.webhooks.models import DeliveryState
from service.webhooks.signature import SIGNATURE, TIMESTAMP, sign

_LONGEST_WAIT_S = 3600.0
_HELD_S = 3.0
"""Timeouts for which a delivery in hand stays untouched by other senders; [1]"""

log = logging.getLogger("robocal.webhooks")


@dataclass(frozen=True)
class Taken:
    """A delivery in this sender's hands."""

    id: int
    url: str
    secret: str
    event: str
    body: bytes
    attempt: int


@dataclass(frozen=True)
class Outcome:
    """What came of one attempt."""

    delivered: bool
    sentence: str


@dataclass(frozen=True)
class Sender:
    """Sends what is due, one after the other."""

    database: Database
    settings: Settings
    shutdown: Event

    def run(self) -> None:
        """Send until the shutdown is wanted."""
        while not self.shutdown.is_set():
            try:
                if self.send_next():
                    continue
            except DBAPIError as error:
                # One delivery may not silence the others; it is tried again when its hold is over.
                log.warning("a delivery was not sent or not noted, going on: %s", error.orig)
            self.shutdown.wait(self.settings.idle_s)

    def send_next(self) -> bool:
        """Try the delivery that is due longest; whether there was one."""
        taken = self._take()
        if taken is None:
            return False
        self._note(taken, self._attempt(taken))
        return True

    def _take(self) -> Taken | None:
        # Looked for without the writers' lock, which an idle sender must not ask for all day.
        with self.database.read() as session:
            now = time.time()
            # Nothing waits longer: what lies farther ahead was noted before the clock was set back.
            farthest = now + max(_LONGEST_WAIT_S, _HELD_S * self.settings.webhook_timeout_s)
            come = (DeliveryRow.due <= now) | (DeliveryRow.due > farthest)
            due = (DeliveryRow.state == DeliveryState.pending) & come
            number = session.scalar(
                select(DeliveryRow.id).where(due).order_by(DeliveryRow.due, DeliveryRow.id).limit(1)
            )
        if number is None:
            return None
        with self.database.write() as session:
            held_until = time.time() + _HELD_S * self.settings.webhook_timeout_s
            won = session.execute(
                update(DeliveryRow)
                .where(DeliveryRow.id == number, due)
                .values(due=held_until, attempts=DeliveryRow.attempts + 1)
                .returning(DeliveryRow.id)
            ).first()
            if won is None:
                return None
            row = session.get_one(DeliveryRow, number)
            webhook = session.get_one(WebhookRow, row.webhook)
            return Taken(
                row.id, webhook.url, webhook.secret, row.event, row.body.encode(), row.attempts
            )

    def _attempt(self, taken: Taken) -> Outcome:
        timeout_s = self.settings.webhook_timeout_s
        try:
            where = destination(taken.url, self.settings.webhook_networks)
            return asyncio.run(_sent(taken, where, timeout_s))
        except Forbidden as error:
            return Outcome(delivered=False, sentence=f"Not sent: {error}.")
        except TimeoutError:
            return Outcome(delivered=False, sentence=f"No answer within {timeout_s:g} s.")
        except (httpx.TransportError, OSError) as error:
            return Outcome(delivered=False, sentence=f"No answer ({type(error).__name__}).")
        except (httpx.InvalidURL, ValueError) as error:
            # A name or an address that shows only when it is used that it cannot be encoded.
            sentence = f"Not sent: the URL cannot be used ({type(error).__name__})."
            return Outcome(delivered=False, sentence=sentence)

    def _note(self, taken: Taken, outcome: Outcome) -> None:
        with self.database.write() as session:
            row = session.get_one(DeliveryRow, taken.id)
            row.outcome = outcome.sentence
            if outcome.delivered:
                row.state, row.finished = DeliveryState.delivered, utc_now()
            elif taken.attempt >= self.settings.webhook_attempts:
                row.state, row.finished = DeliveryState.failed, utc_now()
                log.warning("delivery %d is given up: %s", taken.id, outcome.sentence)
            else:
                wait = self.settings.webhook_retry_s * 2.0 ** (taken.attempt - 1)
                row.due = time.time() + min(wait, _LONGEST_WAIT_S)


async def _sent(taken: Taken, where: Destination, timeout_s: float) -> Outcome:
    """Send and hear the status; raises `TimeoutError` when all that took longer."""
    timestamp = str(int(time.time()))
    headers = {
        "Host": where.host,
        "Content-Type": "application/json",
        "User-Agent": "robocal",
        "Robocal-Event": taken.event,
        "Robocal-Delivery": str(taken.id),
        TIMESTAMP: timestamp,
        SIGNATURE: sign(taken.secret, timestamp, taken.body),
    }
    # One deadline over everything: httpx's own begin anew with every byte that comes. And a stream,
    # because the body of an answer may be endless, and nobody reads it.
    async with (
        asyncio.timeout(timeout_s),
        httpx.AsyncClient(timeout=None, trust_env=False) as client,
        client.stream(
            "POST",
            where.url,
            content=taken.body,
            headers=headers,
            follow_redirects=False,
            extensions={"sni_hostname": where.name},
        ) as answer,
    ):
        return _judged(answer)


def _judged(answer: httpx.Response) -> Outcome:
    status = answer.status_code
    if answer.is_success:
        return Outcome(delivered=True, sentence=f"Answered {status}.")
    if answer.is_redirect:
        sentence = f"Answered {status}: redirects are not followed, give the final URL."
        return Outcome(delivered=False, sentence=sentence)
    return Outcome(delivered=False, sentence=f"Answered {status}.")
