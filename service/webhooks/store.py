"""Subscriptions and their delivery log in the database."""

import json
import secrets

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service.cells import store as cells
from service.clock import utc_now
from service.db.webhook_tables import DeliveryRow, WebhookRow
from service.errors import NotFound, Unusable
from service.webhooks.destination import Forbidden, checked_url
from service.webhooks.models import (
    Deliveries,
    Delivery,
    DeliveryState,
    NewWebhook,
    Webhook,
    WebhookCreated,
    WebhookEvent,
    WebhookRemoved,
    Webhooks,
)
from service.webhooks.outbox import address

_SECRET_BYTES = 32


def create(session: Session, wanted: NewWebhook, person: str) -> WebhookCreated:
    """Store a subscription; its secret is made here and shown once."""
    try:
        checked_url(wanted.url)
    except Forbidden as error:
        raise Unusable(f"body url: {error}.") from error
    if wanted.cell is not None:
        cells.find(session, wanted.cell)
    row = WebhookRow(
        url=wanted.url,
        events=[str(event) for event in dict.fromkeys(wanted.events)],
        cell=wanted.cell,
        secret=secrets.token_urlsafe(_SECRET_BYTES),
        created=utc_now(),
        created_by=person,
    )
    session.add(row)
    session.flush()
    return WebhookCreated(**_shown(row).model_dump(), secret=row.secret)


def find(session: Session, number: int) -> WebhookRow:
    """Return an active subscription; raises `NotFound`."""
    row = session.get(WebhookRow, number)
    if row is None or not row.active:
        raise NotFound(f"There is no webhook {number}.")
    return row


def show(session: Session, number: int) -> Webhook:
    """Return one subscription."""
    return _shown(find(session, number))


def page(session: Session, before: int | None, limit: int) -> Webhooks:
    """Active subscriptions, newest first."""
    query = select(WebhookRow).where(WebhookRow.active).order_by(WebhookRow.id.desc()).limit(limit)
    if before is not None:
        query = query.where(WebhookRow.id < before)
    found = [_shown(row) for row in session.scalars(query)]
    return Webhooks(webhooks=found, next_before=found[-1].id if len(found) == limit else None)


def remove(session: Session, number: int) -> WebhookRemoved:
    """End a subscription; what was not delivered yet is not sent any more, the log stays."""
    row = find(session, number)
    row.active = False
    session.execute(
        update(DeliveryRow)
        .where(DeliveryRow.webhook == number, DeliveryRow.state == DeliveryState.pending)
        .values(state=DeliveryState.cancelled, finished=utc_now())
    )
    return WebhookRemoved(id=number)


def send_test(session: Session, number: int) -> Delivery:
    """Address a test to a subscriber."""
    row = find(session, number)
    return _delivery(address(session, row, WebhookEvent.test, row.cell, {}))


def deliveries(
    session: Session, number: int, state: DeliveryState | None, before: int | None, limit: int
) -> Deliveries:
    """Return the delivery log, newest first."""
    find(session, number)
    query = (
        select(DeliveryRow)
        .where(DeliveryRow.webhook == number)
        .order_by(DeliveryRow.id.desc())
        .limit(limit)
    )
    if state is not None:
        query = query.where(DeliveryRow.state == state)
    if before is not None:
        query = query.where(DeliveryRow.id < before)
    found = [_delivery(row) for row in session.scalars(query)]
    return Deliveries(deliveries=found, next_before=found[-1].id if len(found) == limit else None)


def _shown(row: WebhookRow) -> Webhook:
    return Webhook(
        id=row.id,
        url=row.url,
        events=[WebhookEvent(event) for event in row.events],
        cell=row.cell,
        created=row.created,
        created_by=row.created_by,
    )


def _delivery(row: DeliveryRow) -> Delivery:
    return Delivery(
        id=row.id,
        event=WebhookEvent(row.event),
        state=DeliveryState(row.state),
        attempts=row.attempts,
        outcome=row.outcome,
        body=json.loads(row.body),
        created=row.created,
        finished=row.finished,
    )
