"""REST: how a cell's health went over time."""

from typing import Annotated

from fastapi import APIRouter, Query
from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from service.campaigns.results import ResultKind
from service.cells import store as cells
from service.clock import utc_text
from service.db.models import CampaignRow, ResultRow
from service.dependencies import DatabaseDependency, Moment, PageSize, RowNumber
from service.health_checks.models import CellHealth, HealthPoint

router = APIRouter(prefix="/cells/{cell}/health", tags=["health checks"])


@router.get("")
def get_cell_health(
    cell: str,
    database: DatabaseDependency,
    version: RowNumber | None = None,
    since: Moment | None = None,
    before: Annotated[RowNumber | None, Query(description="checks of earlier campaigns")] = None,
    limit: PageSize = 200,
) -> CellHealth:
    """The series of health checks with their control limits, newest first."""
    with database.read() as session:
        cells.find(session, cell)
        query = (
            select(ResultRow)
            .join(CampaignRow, CampaignRow.id == ResultRow.campaign)
            .where(CampaignRow.cell == cell, ResultRow.kind == ResultKind.health)
            .order_by(ResultRow.campaign.desc(), ResultRow.id.desc())
            .limit(limit)
        )
        if version is not None:
            query = query.where(CampaignRow.parameters_version == version)
        if since is not None:
            query = query.where(ResultRow.created >= utc_text(since))
        if before is not None:
            query = query.where(ResultRow.campaign < before)
        checks = _points(session, query)
    full = len(checks) == limit
    return CellHealth(cell=cell, checks=checks, next_before=checks[-1].campaign if full else None)


def _points(session: Session, query: Select[ResultRow]) -> list[HealthPoint]:
    return [
        HealthPoint.model_validate({**row.document, "campaign": row.campaign, "at": row.created})
        for row in session.scalars(query)
    ]
