"""Versions of a cell's parameters in the database."""

from sqlalchemy import func, select
from sqlalchemy.orm import Session, defer

from service.cells import store as cells
from service.clock import utc_now
from service.db.models import ParametersRow
from service.errors import NotFound
from service.parameters import history
from service.parameters.models import (
    LifeEvent,
    Origin,
    Parameters,
    ParametersContent,
    ParametersState,
    Versions,
    VersionSummary,
)

WAITING = (ParametersState.verified, ParametersState.candidate)
"""The states from which a version is released."""


def add_candidate(
    session: Session, cell: str, campaign: int, content: ParametersContent
) -> ParametersRow:
    """Store a new version that waits for its verification."""
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
    history.record(session, row, LifeEvent.computed, origin_of(content), campaign=campaign)
    return row


def version(session: Session, cell: str, number: int) -> ParametersRow:
    """One version; raises `NotFound`."""
    cells.find(session, cell)
    row = session.get(ParametersRow, (cell, number), options=[defer(ParametersRow.document)])
    if row is None:
        raise NotFound(f"Cell '{cell}' has no version {number} of its parameters.")
    return row


def newest(session: Session, cell: str, state: ParametersState) -> ParametersRow:
    """Return the newest version in a state; raises `NotFound`, naming what there is instead.

    A verified version is still a candidate for its release.
    """
    row = _newest(session, cell, WAITING if state == ParametersState.candidate else (state,))
    if row is not None:
        return row
    cells.find(session, cell)
    waiting = _newest(session, cell, WAITING)
    if waiting is None:
        raise NotFound(
            f"Cell '{cell}' has no {state} parameters; a finished calibration makes a candidate."
        )
    raise NotFound(
        f"Cell '{cell}' has no {state} parameters; version {waiting.version} is "
        f"{'verified' if waiting.state == ParametersState.verified else 'a candidate'}: "
        f"read it with ?state={waiting.state}, release it with "
        f"POST /api/v1/cells/{cell}/parameters/{waiting.version}/release."
    )


def released(session: Session, cell: str) -> ParametersRow | None:
    """Return the version that the MES reads, if there is one."""
    return _newest(session, cell, (ParametersState.released,))


def page(
    session: Session, cell: str, state: ParametersState | None, before: int | None, limit: int
) -> Versions:
    """Versions, newest first."""
    cells.find(session, cell)
    query = (
        select(ParametersRow)
        .where(ParametersRow.cell == cell)
        .order_by(ParametersRow.version.desc())
        .limit(limit)
    )
    if state is not None:
        query = query.where(ParametersRow.state == state)
    if before is not None:
        query = query.where(ParametersRow.version < before)
    found = [_summary(row) for row in session.scalars(query)]
    return Versions(versions=found, next_before=found[-1].version if len(found) == limit else None)


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


def origin_of(content: ParametersContent) -> Origin:
    """From which readings a version was computed."""
    provenance = content.provenance
    return Origin(
        bundle_sha256=provenance.bundle_sha256,
        software_version=provenance.software_version,
        settings=provenance.settings,
        seed=provenance.seed,
    )


def _summary(row: ParametersRow) -> VersionSummary:
    return VersionSummary(
        cell=row.cell,
        version=row.version,
        state=ParametersState(row.state),
        campaign=row.campaign,
        bundle_sha256=row.document["provenance"]["bundle_sha256"],
        created=row.created,
        released=row.released,
    )


def _newest(
    session: Session, cell: str, states: tuple[ParametersState, ...]
) -> ParametersRow | None:
    return session.scalars(
        select(ParametersRow)
        .options(defer(ParametersRow.document))
        .where(ParametersRow.cell == cell, ParametersRow.state.in_(states))
        .order_by(ParametersRow.version.desc())
        .limit(1)
    ).first()
