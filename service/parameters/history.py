"""What happened to a cell's parameters: written once, never changed."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.cells import store as cells
from service.clock import utc_now
from service.db.models import ParametersEventRow, ParametersRow
from service.parameters.models import History, LifeEvent, LifeStep, Origin


def record(
    session: Session,
    row: ParametersRow,
    event: LifeEvent,
    origin: Origin,
    *,
    campaign: int | None = None,
    person: str | None = None,
    reason: str = "",
) -> None:
    """Write a step down, in the transaction that takes it."""
    session.add(
        ParametersEventRow(
            cell=row.cell,
            version=row.version,
            event=event,
            person=person,
            reason=reason,
            campaign=campaign,
            origin=origin.model_dump(mode="json"),
            at=utc_now(),
        )
    )
    session.flush()


def page(
    session: Session, cell: str, version: int | None, before: int | None, limit: int
) -> History:
    """Steps, newest first."""
    cells.find(session, cell)
    query = (
        select(ParametersEventRow)
        .where(ParametersEventRow.cell == cell)
        .order_by(ParametersEventRow.id.desc())
        .limit(limit)
    )
    if version is not None:
        query = query.where(ParametersEventRow.version == version)
    if before is not None:
        query = query.where(ParametersEventRow.id < before)
    steps = [_shown(row) for row in session.scalars(query)]
    return History(
        cell=cell, history=steps, next_before=steps[-1].id if len(steps) == limit else None
    )


def _shown(row: ParametersEventRow) -> LifeStep:
    return LifeStep(
        id=row.id,
        version=row.version,
        event=LifeEvent(row.event),
        person=row.person,
        reason=row.reason,
        campaign=row.campaign,
        origin=Origin.model_validate(row.origin),
        at=row.at,
    )
