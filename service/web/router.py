"""The pages for the operator; mounted at the root of the service."""

from dataclasses import dataclass

from fastapi import APIRouter, Request, Response
from fastapi.responses import HTMLResponse
from sqlalchemy.orm import Session

from service.campaigns import life, poses, results
from service.campaigns import store as campaigns
from service.campaigns.models import ENDED, Campaign, CampaignKind, CampaignState, PoseState
from service.campaigns.results import ResultKind
from service.cells import store as cells
from service.db.engine import Database
from service.dependencies import DatabaseDependency, RowNumber
from service.web import assets, forms, live_view, result_view
from service.web.rendering import page

router = APIRouter(include_in_schema=False)

SHOWN_CAMPAIGNS = 20


@router.get("/")
def home(database: DatabaseDependency) -> HTMLResponse:
    """Cells, campaigns, and the forms that start something."""
    with database.read() as session:
        all_cells = cells.all_cells(session)
        newest = _listed(session, None)
    return page(
        "home.html",
        cells=all_cells,
        listed=newest,
        cell_fields=forms.cell_fields(),
        cell_detail_fields=forms.cell_detail_fields(),
        campaign_fields=forms.campaign_fields([cell.name for cell in all_cells]),
    )


@router.get("/parts/cells")
def cells_part(database: DatabaseDependency) -> HTMLResponse:
    """List the cells anew."""
    with database.read() as session:
        return page("part_cells.html", cells=cells.all_cells(session))


@router.get("/parts/cells/{name}")
def cell_part(name: str, database: DatabaseDependency) -> HTMLResponse:
    """Show one cell anew."""
    with database.read() as session:
        return page("part_cells.html", cells=[cells.shown(cells.find(session, name))])


@router.get("/parts/campaigns")
def campaigns_part(database: DatabaseDependency) -> HTMLResponse:
    """List the newest campaigns anew."""
    with database.read() as session:
        return page("part_campaigns.html", listed=_listed(session, None))


@router.get("/campaigns")
def older_campaigns(database: DatabaseDependency, before: RowNumber | None = None) -> HTMLResponse:
    """List campaigns that the first page has no room for."""
    with database.read() as session:
        return page("campaigns.html", listed=_listed(session, before))


@router.get("/campaigns/{number}")
def campaign_page(number: RowNumber, database: DatabaseDependency) -> HTMLResponse:
    """Live progress of a campaign, and its result."""
    with database.read() as session:
        shown = campaigns.shown(session, life.find(session, number))
        own_cell = [cells.shown(cells.find(session, shown.cell))] if shown.cell else []
    return page(
        "campaign.html", campaign=shown, cells=own_cell, ended=False, enough=live_view.ENOUGH
    )


@router.get("/parts/campaigns/{number}/skipped")
def skipped_part(number: RowNumber, database: DatabaseDependency) -> HTMLResponse:
    """List the poses that were left out; empty where none was."""
    with database.read() as session:
        row = life.find(session, number)
        left_out = poses.poses(session, row, PoseState.skipped).poses
    return page("part_skipped.html", skipped=left_out)


@router.get("/parts/campaigns/{number}/result")
def result_part(number: RowNumber, database: DatabaseDependency) -> HTMLResponse:
    """Tables of a result; empty until there is one."""
    with database.read() as session:
        shown = campaigns.shown(session, life.find(session, number))
    if shown.state is not CampaignState.finished:
        return page("part_no_result.html", ended=shown.state in ENDED)
    if shown.kind is CampaignKind.verify:
        return _verification(database, shown)
    if shown.kind is CampaignKind.health:
        return _health(database, shown)
    return _identification(database, shown)


@router.get("/assets/{collection}/{version}/{file}")
def asset(request: Request, collection: str, version: str, file: str) -> Response:
    """Style, scripts and plotly.js."""
    return assets.answer(request, collection, version, file)


@dataclass(frozen=True)
class Listed:
    """Some campaigns, newest first."""

    campaigns: list[Campaign]
    older_than: int | None
    """Where the next, older ones begin; None if there are none."""


def _listed(session: Session, before: int | None) -> Listed:
    found = campaigns.page(session, campaigns.EVERY, before, SHOWN_CAMPAIGNS + 1)
    shown = found[:SHOWN_CAMPAIGNS]
    return Listed(shown, shown[-1].id if len(found) > len(shown) else None)


def _identification(database: Database, campaign: Campaign) -> HTMLResponse:
    with database.read() as session:
        found = results.newest(session, campaign.id, ResultKind.identification)
        identification, version = found.document, found.software_version
        uncertainty = results.newest(session, campaign.id, ResultKind.uncertainty).document
    return page(
        "part_identification.html",
        campaign=campaign,
        identification=identification,
        uncertainty=uncertainty,
        software_version=version,
        reduction=result_view.identification_reduction(identification),
        parameters=result_view.parameter_lines(identification),
        base=result_view.frame_lines(identification, "base"),
        tool=result_view.frame_lines(identification, "tool"),
        residuals=result_view.residual_lines(identification),
        adequacy=result_view.adequacy_verdict(identification),
        intervals=result_view.intervals_verdict(uncertainty),
        drift=result_view.drift_line(identification),
    )


def _health(database: Database, campaign: Campaign) -> HTMLResponse:
    with database.read() as session:
        found = results.newest(session, campaign.id, ResultKind.health).document
    return page("part_health.html", campaign=campaign, found=found)


def _verification(database: Database, campaign: Campaign) -> HTMLResponse:
    with database.read() as session:
        verification = results.newest(session, campaign.id, ResultKind.verification).document
    return page(
        "part_verification.html",
        campaign=campaign,
        reduction=result_view.verification_reduction(verification),
        errors_of=result_view.verification_lines(verification),
    )
