"""Versions of a pair's base-to-base transform: candidate, released by a person, superseded."""

from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.base_calibrations.models import (
    BaseTransform,
    BaseTransformHead,
    BaseTransforms,
    TransformEvent,
    TransformState,
    TransformStep,
)
from service.clock import utc_now
from service.db.base_calibration_tables import BaseTransformEventRow, BaseTransformRow
from service.errors import Conflict, NotFound


def add_candidate(
    session: Session,
    *,
    name: str,
    calibration: int,
    document: dict[str, Any],
    bundle_sha256: str,
    software_version: str,
    settings: dict[str, Any],
    person: str,
) -> BaseTransformRow:
    """Store a new version that waits for its release."""
    last = session.scalar(
        select(func.max(BaseTransformRow.version)).where(BaseTransformRow.name == name)
    )
    row = BaseTransformRow(
        name=name,
        version=(last or 0) + 1,
        state=TransformState.candidate,
        calibration=calibration,
        document=document,
        bundle_sha256=bundle_sha256,
        software_version=software_version,
        settings=settings,
        created=utc_now(),
    )
    session.add(row)
    session.flush()
    _record(session, row, TransformEvent.made, person, f"by base calibration {calibration}")
    return row


def version(session: Session, name: str, number: int) -> BaseTransformRow:
    """Return one version; raises `NotFound`."""
    row = session.get(BaseTransformRow, (name, number))
    if row is None:
        raise NotFound(f"The pair '{name}' has no version {number} of its base transform.")
    return row


def of_calibration(session: Session, calibration: int) -> BaseTransformRow:
    """Return the version that a base calibration made; raises `NotFound`."""
    row = session.scalar(
        select(BaseTransformRow).where(BaseTransformRow.calibration == calibration)
    )
    if row is None:
        raise NotFound(
            f"Base calibration {calibration} has no result yet; finish it with "
            f"POST /api/v1/base-calibrations/{calibration}/finish."
        )
    return row


def newest(session: Session, name: str, state: TransformState) -> BaseTransformRow:
    """Return the newest version in a state; raises `NotFound`, naming what there is instead."""
    row = _newest(session, name, state)
    if row is not None:
        return row
    candidate = _newest(session, name, TransformState.candidate)
    if candidate is None:
        raise NotFound(
            f"The pair '{name}' has no {state} base transform; a finished base calibration of "
            "that name makes a candidate."
        )
    raise NotFound(
        f"The pair '{name}' has no {state} base transform; version {candidate.version} is a "
        f"candidate: release it with POST /api/v1/base-transforms/{name}/{candidate.version}"
        "/release."
    )


def versions(session: Session, name: str) -> BaseTransforms:
    """List all versions of a pair and its history; raises `NotFound` where there is none."""
    rows = session.scalars(
        select(BaseTransformRow)
        .where(BaseTransformRow.name == name)
        .order_by(BaseTransformRow.version.desc())
    ).all()
    if not rows:
        raise NotFound(f"There is no base transform of a pair named '{name}'.")
    steps = session.scalars(
        select(BaseTransformEventRow)
        .where(BaseTransformEventRow.name == name)
        .order_by(BaseTransformEventRow.id.desc())
    )
    return BaseTransforms(
        name=name,
        versions=[_head(row) for row in rows],
        history=[
            TransformStep(
                version=step.version,
                event=TransformEvent(step.event),
                person=step.person,
                reason=step.reason,
                at=step.at,
            )
            for step in steps
        ],
    )


def release(session: Session, name: str, number: int, person: str, reason: str) -> BaseTransform:
    """Let the plant use a candidate; the version released before is superseded.

    Raises
    ------
    Conflict
        If the version is no candidate, or its result is doubtful and no reason is given.
    """
    row = version(session, name, number)
    if row.state != TransformState.candidate:
        hint = "roll back to it" if row.state == TransformState.superseded else "nothing to do"
        raise Conflict(
            f"Version {number} of the pair '{name}' is {row.state}; only a candidate is released "
            f"({hint})."
        )
    doubts = doubts_of(row.document)
    if doubts and not reason.strip():
        raise Conflict(
            f"Version {number} of the pair '{name}' is doubtful: {'; '.join(doubts)}; make a new "
            "base calibration, or give a `reason` for releasing it as it is."
        )
    return _put_in_place(session, row, TransformEvent.released, person, reason)


def rollback(session: Session, name: str, number: int, person: str, reason: str) -> BaseTransform:
    """Let the plant use a version again that was released before; raises `Conflict`."""
    row = version(session, name, number)
    if row.state != TransformState.superseded:
        raise Conflict(
            f"Version {number} of the pair '{name}' is {row.state}; "
            "a rollback goes to a version that was released before and is superseded."
        )
    return _put_in_place(session, row, TransformEvent.rolled_back, person, reason)


def doubts_of(document: dict[str, Any]) -> list[str]:
    """What speaks against using a result: open directions, and faults that are not remedied."""
    left_open = [f"{entry['direction']} is left open" for entry in document["undetermined"]]
    faults = [
        f"a fault of {fault['fault']} is not remedied"
        for fault in document["faults"]
        if not fault["remedied"]
    ]
    return left_open + faults


def _put_in_place(
    session: Session, row: BaseTransformRow, event: TransformEvent, person: str, reason: str
) -> BaseTransform:
    before = _newest(session, row.name, TransformState.released)
    if before is not None:
        before.state = TransformState.superseded
        # Before the next one, or the database sees two released versions.
        session.flush()
        _record(session, before, TransformEvent.superseded, person, f"by version {row.version}")
    row.state, row.released = TransformState.released, utc_now()
    _record(session, row, event, person, reason)
    return shown(row)


def _record(
    session: Session, row: BaseTransformRow, event: TransformEvent, person: str, reason: str
) -> None:
    session.add(
        BaseTransformEventRow(
            name=row.name,
            version=row.version,
            event=event,
            person=person,
            reason=reason,
            at=utc_now(),
        )
    )
    session.flush()


def shown(row: BaseTransformRow) -> BaseTransform:
    """Show a version as it goes over HTTP."""
    return BaseTransform(
        **_head(row).model_dump(),
        name=row.name,
        bundle_sha256=row.bundle_sha256,
        software_version=row.software_version,
        result=row.document,
    )


def _head(row: BaseTransformRow) -> BaseTransformHead:
    return BaseTransformHead(
        version=row.version,
        state=TransformState(row.state),
        base_calibration=row.calibration,
        created=row.created,
        released=row.released,
    )


def _newest(session: Session, name: str, state: TransformState) -> BaseTransformRow | None:
    return session.scalars(
        select(BaseTransformRow)
        .where(BaseTransformRow.name == name, BaseTransformRow.state == state)
        .order_by(BaseTransformRow.version.desc())
        .limit(1)
    ).first()
