"""The life of parameters: candidate, verified, released by a person, superseded, rolled back.

Each function works in the caller's transaction and writes its step into the history. The MES reads
the one released version of a cell, which a unique index of the database holds to one.
"""

from sqlalchemy.orm import Session

from service.clock import utc_now
from service.db.models import ParametersRow
from service.errors import Conflict
from service.parameters import history, store
from service.parameters.models import (
    LifeEvent,
    Origin,
    Parameters,
    ParametersContent,
    ParametersState,
)
from service.webhooks.models import WebhookEvent
from service.webhooks.outbox import announce


def note_verification(
    session: Session,
    row: ParametersRow,
    campaign: int,
    origin: Origin,
    failures: list[str],
) -> None:
    """Take the result of a verifying campaign in; a released version stays released."""
    passed = not failures
    if row.state in store.WAITING:
        row.state = ParametersState.verified if passed else ParametersState.candidate
    event = LifeEvent.verified if passed else LifeEvent.verification_failed
    history.record(session, row, event, origin, campaign=campaign, reason=" ".join(failures))


def release(session: Session, cell: str, number: int, person: str, reason: str) -> Parameters:
    """Let the MES use a version; the one released before is superseded.

    Raises
    ------
    Conflict
        If the version is neither verified nor, with a reason, a candidate.
    """
    row = store.version(session, cell, number)
    if row.state not in store.WAITING:
        hint = "roll back to it" if row.state == ParametersState.superseded else "nothing to do"
        raise Conflict(
            f"Version {number} of cell '{cell}' is {row.state}; only a verified version or a "
            f"candidate is released ({hint})."
        )
    if row.state == ParametersState.candidate and not reason.strip():
        raise Conflict(
            f"Version {number} of cell '{cell}' is not verified; run a campaign of kind 'verify' "
            "that passes its criterion, or give a `reason` for releasing it as it is."
        )
    return _put_in_place(session, row, LifeEvent.released, person, reason)


def rollback(session: Session, cell: str, number: int, person: str, reason: str) -> Parameters:
    """Let the MES use a version again that was released before; raises `Conflict`."""
    row = store.version(session, cell, number)
    if row.state != ParametersState.superseded:
        raise Conflict(
            f"Version {number} of cell '{cell}' is {row.state}; "
            "a rollback goes to a version that was released before and is superseded."
        )
    return _put_in_place(session, row, LifeEvent.rolled_back, person, reason)


def _put_in_place(
    session: Session, row: ParametersRow, event: LifeEvent, person: str, reason: str
) -> Parameters:
    before = store.released(session, row.cell)
    if before is not None:
        before.state = ParametersState.superseded
        # Before the next one, or the database sees two released versions.
        session.flush()
        history.record(
            session,
            before,
            LifeEvent.superseded,
            _origin(before),
            person=person,
            reason=f"by version {row.version}",
        )
    row.state = ParametersState.released
    row.released = utc_now()
    history.record(session, row, event, _origin(row), person=person, reason=reason)
    content = {"version": row.version, "step": event, "person": person, "reason": reason}
    announce(session, WebhookEvent.parameters_released, row.cell, content)
    return store.shown(row)


def _origin(row: ParametersRow) -> Origin:
    return store.origin_of(ParametersContent.model_validate(row.document))
