"""The diagnosis on a campaign's page, and the follow-up that it may ask for."""

import json

from fastapi import APIRouter
from fastapi.responses import HTMLResponse
from markupsafe import Markup

from service.campaigns import life, results
from service.campaigns import store as campaigns
from service.campaigns.results import ResultKind
from service.db.models import ResultFileRow
from service.dependencies import DatabaseDependency, RowNumber
from service.errors import NotFound
from service.web import forms
from service.web.rendering import page

router = APIRouter(include_in_schema=False)

PAGE = "page.json"


@router.get("/parts/campaigns/{number}/diagnosis")
def diagnosis_part(number: RowNumber, database: DatabaseDependency) -> HTMLResponse:
    """Causes with their evidence, what to do at the machine, what to measure next."""
    with database.read() as session:
        shown = campaigns.shown(session, life.find(session, number))
        try:
            found = results.newest(session, number, ResultKind.diagnosis)
        except NotFound:
            return page("part_no_diagnosis.html", campaign=shown)
        stored = session.get_one(ResultFileRow, (found.id, PAGE))
        parts = json.loads(stored.content)
        document = found.document
    return page(
        "part_diagnosis.html",
        campaign=shown,
        found=parts,
        # With too little measured there is none, whatever it is called.
        verdict=document["verdict"] if document["adequacy"]["judged"] else None,
        # Drawn by the service itself, with every text in them escaped.
        plot=Markup(parts["plot"]),
        plots=[Markup(plot) for plot in parts["plots"]],
        asks=document["next_poses"] is not None and shown.cell is not None,
        # Another payload tells nothing where it is not known what was held before.
        payload=None if shown.payload_kg is None else forms.payload_field(shown.payload_kg),
    )
