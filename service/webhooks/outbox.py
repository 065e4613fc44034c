"""Put an event into the outbox, in the transaction that makes it: both happen or neither."""

import json
import time
from typing import Any

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from service.clock import utc_now
from service.db.webhook_tables import DeliveryRow, WebhookRow
from service.webhooks.models import WebhookEvent

Json = dict[str, Any]


def announce(session: Session, event: WebhookEvent, cell: str | None, content: Json) -> None:
    """Address an event to everybody who subscribed to it."""
    rows = session.scalars(
        select(WebhookRow).where(
            WebhookRow.active, or_(WebhookRow.cell.is_(None), WebhookRow.cell == cell)
        )
    )
    for row in rows:
        if event in row.events:
            address(session, row, event, cell, content)


def address(
    session: Session, row: WebhookRow, event: WebhookEvent, cell: str | None, content: Json
) -> DeliveryRow:
    """Address an event to one subscriber."""
    body = {"event": event, "at": utc_now(), "cell": cell, **content}
    delivery = DeliveryRow(
        webhook=row.id,
        event=event,
        body=json.dumps(body, separators=(",", ":")),
        due=time.time(),
        created=utc_now(),
    )
    session.add(delivery)
    session.flush()
    return delivery
