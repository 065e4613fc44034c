"""Tables of webhooks: who wants to hear what, and the outbox of what is to be sent."""

from sqlalchemy import CheckConstraint, ForeignKey, Index
from sqlalchemy.orm import Mapped, mapped_column

from service.db.base import Base


class WebhookRow(Base):
    """One subscription."""

    __tablename__ = "webhook"

    id: Mapped[int] = mapped_column(primary_key=True)
    url: Mapped[str]
    events: Mapped[list[str]]
    cell: Mapped[str | None] = mapped_column(ForeignKey("cell.name"))
    """None: of all cells."""
    secret: Mapped[str]
    """As it is, because every delivery is signed with it."""
    active: Mapped[bool] = mapped_column(default=True)
    created: Mapped[str]
    created_by: Mapped[str]


class DeliveryRow(Base):
    """One event on its way to one subscriber; written in the transaction that made the event."""

    __tablename__ = "webhook_delivery"

    id: Mapped[int] = mapped_column(primary_key=True)
    webhook: Mapped[int] = mapped_column(ForeignKey("webhook.id"))
    event: Mapped[str]
    body: Mapped[str]
    state: Mapped[str] = mapped_column(default="pending")
    attempts: Mapped[int] = mapped_column(default=0)
    due: Mapped[float]
    """When to try next; while it is being sent, when another worker may. Host clock [s]."""
    outcome: Mapped[str] = mapped_column(default="")
    """What came of the latest attempt, one sentence."""
    created: Mapped[str]
    finished: Mapped[str | None]

    __table_args__ = (
        CheckConstraint("state IN ('pending','delivered','failed','cancelled')", name="state"),
        Index(None, "state", "due"),
        Index(None, "webhook"),
    )
