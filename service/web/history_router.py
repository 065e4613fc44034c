"""Pages about more than one campaign: a cell's parameters and health, two calibrations."""

from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import HTMLResponse
from sqlalchemy.orm import Session

from service.campaigns import life, results, store
from service.campaigns.models import Campaign, CampaignKind, CampaignState
from service.campaigns.results import ResultKind
from service.cells import store as cells
from service.dependencies import DatabaseDependency, RowNumber
from service.parameters import history
from service.parameters import store as parameters
from service.web import compare_view
from service.web.compare_view import Json
from service.web.rendering import page

router = APIRouter(include_in_schema=False)

SHOWN_VERSIONS = 50
SHOWN_STEPS = 50
OFFERED = 100
"""Calibrations that a comparison is offered of."""


@router.get("/cells/{name}")
def cell_page(name: str, database: DatabaseDependency) -> HTMLResponse:
    """Which parameters the cell's MES reads, how they came about, how the cell's health goes."""
    with database.read() as session:
        return page(
            "cell.html",
            cell=cells.shown(cells.find(session, name)),
            versions=parameters.page(session, name, None, None, SHOWN_VERSIONS).versions,
            steps=history.page(session, name, None, None, SHOWN_STEPS).history,
        )


@router.get("/compare")
def compare_page(
    database: DatabaseDependency,
    first: Annotated[RowNumber | None, Query()] = None,
    second: Annotated[RowNumber | None, Query()] = None,
) -> HTMLResponse:
    """Two calibrations side by side."""
    with database.read() as session:
        offered = _calibrations(session)
        if first is None or second is None:
            return page("compare.html", offered=offered, first=first, second=second, found=None)
        one, other = _identification(session, first), _identification(session, second)
        robots = {life.find(session, number).robot_yaml for number in (first, second)}
    return page(
        "compare.html",
        offered=offered,
        first=first,
        second=second,
        found={"first": one, "second": other},
        same_robot=len(robots) == 1,
        parameters=compare_view.compared_parameters(one, other),
        errors_of=compare_view.compared_errors(one, other),
        limit=compare_view.CLEAR,
    )


def _identification(session: Session, number: int) -> Json:
    document: Json = results.newest(session, number, ResultKind.identification).document
    return document


def _calibrations(session: Session) -> list[Campaign]:
    kinds = (CampaignKind.calibrate, CampaignKind.follow_up)
    done = store.Filter(kinds=kinds, state=CampaignState.finished)
    return store.page(session, done, None, OFFERED)
