"""The audit trail: who changed what, and how it ended. Rows are added, never changed.

A deed is written in the transaction that does it, where there is one (see `service.idempotency`);
a refused or failed one before its answer goes out. Reading is not recorded, nor are requests that
came without any credentials: anybody could fill the disk with them.
"""

from dataclasses import dataclass, field

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.access.scopes import ASKING
from service.clock import utc_now
from service.db.access_tables import AuditRow

READING = ("GET ", "HEAD ", "OPTIONS ")


@dataclass
class Deed:
    """What one request is about to do; `written` once the trail holds it."""

    who: str
    action: str
    object: str
    address: str
    written: bool = field(default=False)

    @property
    def changes(self) -> bool:
        """Whether it changes anything, for nothing else is kept."""
        return not self.action.startswith(READING) and self.action not in ASKING

    def write(self, session: Session, status: int) -> None:
        """Add it to the trail, as part of the transaction at hand."""
        if self.changes:
            record(session, self.who, self.action, self.object, status, self.address)


def record(
    session: Session, who: str, action: str, what: str, status: int, address: str = ""
) -> None:
    """Add one line to the trail."""
    session.add(
        AuditRow(
            at=utc_now(),
            who=who,
            action=action,
            object=what,  # A plain number: a database driver may take an enumeration for text.
            status=int(status),
            address=address,
        )
    )


def page(session: Session, before: int | None, limit: int) -> list[AuditRow]:
    """Lines older than one, newest first."""
    query = select(AuditRow).order_by(AuditRow.id.desc()).limit(limit)
    if before is not None:
        query = query.where(AuditRow.id < before)
    return list(session.scalars(query))
