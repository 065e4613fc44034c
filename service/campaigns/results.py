"""What was computed from a campaign."""

from enum import StrEnum

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.campaigns import life
from service.db.models import ResultRow
from service.errors import NotFound


class ResultKind(StrEnum):
    """Which of the documents."""

    identification = "identification"
    uncertainty = "uncertainty"
    verification = "verification"


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
