"""What was computed from a campaign."""

from enum import StrEnum

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.campaigns import life
from service.db.models import ResultFileRow, ResultRow
from service.errors import NotFound


class ResultKind(StrEnum):
    """Which of the documents."""

    identification = "identification"
    uncertainty = "uncertainty"
    verification = "verification"
    diagnosis = "diagnosis"
    health = "health"


def newest(session: Session, campaign: int, kind: ResultKind) -> ResultRow:
    """Return the latest result of this kind; raises `NotFound`, saying how the campaign stands."""
    row = life.find(session, campaign)
    result = session.scalars(
        select(ResultRow)
        .where(ResultRow.campaign == campaign, ResultRow.kind == kind)
        .order_by(ResultRow.id.desc())
        .limit(1)
    ).first()
    if result is None:
        because = f": {row.reason.removesuffix('.')}" if row.reason else ""
        raise NotFound(
            f"Campaign {campaign} ({row.kind}) has no {kind}; it is {row.state}{because}."
        )
    return result


def diagnosis_file(session: Session, campaign: int, name: str) -> bytes:
    """Return a file of the newest diagnosis; raises `NotFound`."""
    result = newest(session, campaign, ResultKind.diagnosis)
    file = session.get(ResultFileRow, (result.id, name))
    if file is None:
        raise NotFound(
            f"The diagnosis of campaign {campaign} has no {name}: it leaves no choice between "
            "causes that further poses would settle."
        )
    return file.content
