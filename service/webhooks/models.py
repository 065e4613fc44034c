"""Webhooks as they go over HTTP."""

from enum import StrEnum
from typing import Annotated, Any

from pydantic import BaseModel, Field

from service.cells.models import CellName, Strict
from service.plain_text import PlainText


class WebhookEvent(StrEnum):
    """What a subscriber can hear of."""

    campaign_finished = "campaign.finished"
    """A campaign ended: finished, failed or aborted."""
    parameters_released = "parameters.released"
    """The MES reads another version now, after a release or a rollback."""
    drift_alarm = "drift.alarm"
    """A health check found that something has moved."""
    test = "webhook.test"
    """Sent on request, to every webhook."""


class DeliveryState(StrEnum):
    """How far a delivery has come."""

    pending = "pending"
    delivered = "delivered"
    failed = "failed"
    cancelled = "cancelled"


class NewWebhook(Strict):
    """A subscription."""

    url: Annotated[PlainText, Field(min_length=8, max_length=2000)]
    """http or https, without user and password."""
    events: Annotated[list[WebhookEvent], Field(min_length=1)]
    cell: CellName | None = None
    """Of this cell alone; of all if not given."""


class Webhook(BaseModel):
    """A subscription without its secret."""

    id: int
    url: str
    events: list[WebhookEvent]
    cell: str | None
    created: str
    created_by: str


class WebhookCreated(Webhook):
    """A new subscription, with the secret that is shown this once."""

    secret: str
    """Key of the signatures: keep it, it is not shown again."""


class Webhooks(BaseModel):
    """A page of subscriptions, newest first."""

    webhooks: list[Webhook]
    next_before: int | None
    """`?before=` of the next page; null on the last one."""


class Delivery(BaseModel):
    """One event on its way to one subscriber."""

    id: int
    event: WebhookEvent
    state: DeliveryState
    attempts: int
    outcome: str
    """What came of the latest attempt."""
    body: dict[str, Any]
    created: str
    finished: str | None


class Deliveries(BaseModel):
    """A page of the delivery log, newest first."""

    deliveries: list[Delivery]
    next_before: int | None
    """`?before=` of the next page; null on the last one."""


class WebhookRemoved(BaseModel):
    """The answer to a removal."""

    id: int
    removed: bool = True
