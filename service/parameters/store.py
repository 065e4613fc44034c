"""Versions of a cell's parameters: candidate, released by a person, superseded."""

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.cells import store as cells
from service.clock import utc_now
from service.db.models import ParametersRow
from service.errors import Conflict, NotFound
from service.parameters.models import Parameters, ParametersContent, ParametersState


def add_candidate(
    session: Session, cell: str, campaign: int, content: ParametersContent
) -> ParametersRow:
    """Store a new version that waits for its release."""
    last = session.scalar(select(func.max(ParametersRow.version)).where(ParametersRow.cell == cell))
    row = ParametersRow(
        cell=cell,
        version=(last or 0) + 1,
        state=ParametersState.candidate,
        document=content.model_dump(mode="json"),
        campaign=campaign,
        created=utc_now(),
    )
    session.add(row)
    session.flush()
    return row


def version(session: Session, cell: str, number: int) -> ParametersRow:
    """One version; raises `NotFound`."""
    cells.find(session, cell)
    row = session.get(ParametersRow, (cell, number))
    if row is None:
        raise NotFound(f"Cell '{cell}' has no version {number} of its parameters.")
    return row


def newest(session: Session, cell: str, state: ParametersState) -> ParametersRow:
    """Return the newest version in a state; raises `NotFound`, naming what there is instead."""
    cells.find(session, cell)
    row = _newest(session, cell, state)
    if row is not None:
        return row
    candidate = _newest(session, cell, ParametersState.candidate)
    if candidate is None:
        raise NotFound(
            f"Cell '{cell}' has no {state} parameters; a finished calibration makes a candidate."
        )
    raise NotFound(
        f"Cell '{cell}' has no {state} parameters; version {candidate.version} is a candidate: "
        f"read it with ?state=candidate, release it with "
        f"POST /api/v1/cells/{cell}/parameters/{candidate.version}/release."
    )


def release(session: Session, cell: str, number: int) -> Parameters:
    """Let the MES use a candidate; the version released before is superseded."""
    row = version(session, cell, number)
    if row.state != ParametersState.candidate:
        raise Conflict(
            f"Version {number} of cell '{cell}' is {row.state}; only a candidate is released."
        )
    before = _newest(session, cell, ParametersState.released)
    if before is not None:
        before.state = ParametersState.superseded
        # Before the next one, or the database sees two released versions.
        session.flush()
    row.state = ParametersState.released
    row.released = utc_now()
    return shown(row)


def shown(row: ParametersRow) -> Parameters:
    """Show a version as it goes over HTTP."""
    content = ParametersContent.model_validate(row.document)
    return Parameters(
        cell=row.cell,
        version=row.version,
        state=ParametersState(row.state),
        created=row.created,
        released=row.released,
        **dict(content),
    )


def _newest(session: Session, cell: str, state: ParametersState) -> ParametersRow | None:
    return session.scalars(
        select(ParametersRow)
        .where(ParametersRow.cell == cell, ParametersRow.state == state)
        .order_by(ParametersRow.version.desc())
        .limit(1)
    ).first()
