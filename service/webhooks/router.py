"""REST: webhooks, by which the MES hears of what happened instead of asking."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Query, Response

from service.dependencies import (
    DatabaseDependency,
    OnceDependency,
    PageSize,
    PersonDependency,
    RowNumber,
)
from service.webhooks import store
from service.webhooks.models import (
    Deliveries,
    Delivery,
    DeliveryState,
    NewWebhook,
    Webhook,
    WebhookCreated,
    WebhookRemoved,
    Webhooks,
)

SHOWN_ONCE = "shown in the first answer alone"
"""What a repeated request reads in place of the secret."""

router = APIRouter(prefix="/webhooks", tags=["webhooks"])


@router.post("", status_code=HTTPStatus.CREATED, response_model=WebhookCreated)
def create_webhook(wanted: NewWebhook, once: OnceDependency, person: PersonDependency) -> Response:
    """Subscribe a URL to events; the answer shows the secret of the signatures this once."""
    return once.answer(
        lambda session: store.create(session, wanted, person),
        HTTPStatus.CREATED,
        kept=lambda made: made.model_copy(update={"secret": SHOWN_ONCE}),
    )


@router.get("")
def list_webhooks(
    database: DatabaseDependency,
    before: Annotated[RowNumber | None, Query(description="webhooks older than this one")] = None,
    limit: PageSize = 50,
) -> Webhooks:
    """Subscriptions, newest first, a page at a time."""
    with database.read() as session:
        return store.page(session, before, limit)


@router.get("/{webhook}")
def get_webhook(webhook: RowNumber, database: DatabaseDependency) -> Webhook:
    """One subscription."""
    with database.read() as session:
        return store.show(session, webhook)


@router.post("/{webhook}/remove", response_model=WebhookRemoved)
def remove_webhook(webhook: RowNumber, once: OnceDependency) -> Response:
    """End a subscription; what waits for delivery is not sent any more."""
    return once.answer(lambda session: store.remove(session, webhook))


@router.post("/{webhook}/test", status_code=HTTPStatus.ACCEPTED, response_model=Delivery)
def send_test(webhook: RowNumber, once: OnceDependency) -> Response:
    """Send a test event, whatever is subscribed."""
    return once.answer(lambda session: store.send_test(session, webhook), HTTPStatus.ACCEPTED)


@router.get("/{webhook}/deliveries")
def list_deliveries(
    webhook: RowNumber,
    database: DatabaseDependency,
    state: DeliveryState | None = None,
    before: Annotated[RowNumber | None, Query(description="deliveries older than this one")] = None,
    limit: PageSize = 50,
) -> Deliveries:
    """What was sent, how often, and what came of it, newest first."""
    with database.read() as session:
        return store.deliveries(session, webhook, state, before, limit)
