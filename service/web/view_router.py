"""What the scripts of the pages ask for while a person fills in a form or watches."""

from typing import Annotated

from fastapi import APIRouter, Query

from service.campaigns import life
from service.campaigns.models import MOST_POSES, CampaignKind
from service.cells import store as cells
from service.dependencies import DatabaseDependency, RowNumber
from service.web import campaign_check, live_view, plan_preview

router = APIRouter(prefix="/parts", include_in_schema=False)

Count = Annotated[int, Query(ge=1, le=MOST_POSES)]


@router.get("/cells/{name}/check")
def check_form(
    name: str, kind: CampaignKind, poses: Count, database: DatabaseDependency
) -> list[campaign_check.Note]:
    """Say what stands against a campaign, or for it, before it is started."""
    with database.read() as session:
        return campaign_check.notes(session, name, kind, poses)


@router.get("/cells/{name}/plan")
def preview_plan(
    name: str, poses: Count, seed: RowNumber, database: DatabaseDependency
) -> plan_preview.PlanPreview:
    """Plan a calibration without starting it."""
    with database.read() as session:
        settings = cells.settings_of(cells.find(session, name))
    return plan_preview.preview(settings, poses, seed)


@router.get("/campaigns/{number}/tips")
def planned_tips(number: RowNumber, database: DatabaseDependency) -> live_view.PlannedTips:
    """Where the target of a campaign goes."""
    with database.read() as session:
        return live_view.planned_tips(session, number)


@router.get("/campaigns/{number}/live")
def watch(number: RowNumber, database: DatabaseDependency) -> live_view.Live | None:
    """Return arm, residuals and sensors after the latest reading."""
    with database.read() as session:
        row = life.find(session, number)
        created, revision = row.created, row.revision
    return live_view.live(database, number, created, revision)
