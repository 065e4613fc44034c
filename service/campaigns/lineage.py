"""Campaigns that belong together: a follow-up and those whose question it is about."""

from collections.abc import Sequence
from itertools import pairwise

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.db.models import CampaignRow, ReadingRow

MOST_CAMPAIGNS = 20
"""In a chain of follow-ups; more says that something else is wrong."""


def lineage(session: Session, row: CampaignRow) -> list[CampaignRow]:
    """Return the campaigns that a campaign's bundle is pooled from, oldest first, itself last."""
    chain = [row]
    while chain[0].follows is not None and len(chain) < MOST_CAMPAIGNS:
        chain.insert(0, session.get_one(CampaignRow, chain[0].follows))
    return chain


def starts_s(session: Session, chain: Sequence[CampaignRow]) -> list[float]:
    """When each campaign's first reading was, on the clock of the first one [s].

    The robot's clock counts through, unless its controller was restarted in between: then a
    campaign is taken to begin where the one before ended.
    """
    clocks = [_clock(session, row.id) for row in chain]
    starts = [0.0]
    for (before, length), (begin, _) in pairwise(clocks):
        starts.append(starts[-1] + max(begin - before, length))
    return starts


def _clock(session: Session, campaign: int) -> tuple[float, float]:
    """Return the robot's time at the first reading, and the campaign's length [s]."""
    begin, length = session.execute(
        select(func.min(ReadingRow.robot_time_s - ReadingRow.t_s), func.max(ReadingRow.t_s)).where(
            ReadingRow.campaign == campaign
        )
    ).one()
    return begin or 0.0, length or 0.0
