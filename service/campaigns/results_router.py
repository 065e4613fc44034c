"""REST: what was computed from a campaign, and computing it again."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Body, Response
from fastapi.responses import HTMLResponse, JSONResponse

from service.campaigns import repeats, results
from service.campaigns.models import Computation, IdentificationWish, ResultDocument
from service.campaigns.results import ResultKind
from service.db.engine import Database
from service.dependencies import DatabaseDependency, OnceDependency, QueueDependency, RowNumber

router = APIRouter(prefix="/campaigns/{campaign}", tags=["results"])

REPORT, NEXT_POSES = "report.html", "next_poses.csv"
# The report styles itself and needs nothing else: it may be opened but not run anything.
_ALONE = {"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; sandbox"}


@router.get("/identification", response_model=ResultDocument)
def get_identification(campaign: RowNumber, database: DatabaseDependency) -> Response:
    """identification.json of the newest run."""
    return _document(database, campaign, ResultKind.identification)


@router.get("/uncertainty", response_model=ResultDocument)
def get_uncertainty(campaign: RowNumber, database: DatabaseDependency) -> Response:
    """uncertainty.json of the newest run."""
    return _document(database, campaign, ResultKind.uncertainty)


@router.get("/verification", response_model=ResultDocument)
def get_verification(campaign: RowNumber, database: DatabaseDependency) -> Response:
    """Pose error before and after compensation, at poses that no fit has seen."""
    return _document(database, campaign, ResultKind.verification)


@router.get("/health", response_model=ResultDocument)
def get_health(campaign: RowNumber, database: DatabaseDependency) -> Response:
    """Whether the released model is still right, and what moved if not."""
    return _document(database, campaign, ResultKind.health)


@router.get("/diagnosis", response_model=ResultDocument)
def get_diagnosis(campaign: RowNumber, database: DatabaseDependency) -> Response:
    """diagnosis.json of the newest run: what the geometric model gets wrong, and why."""
    return _document(database, campaign, ResultKind.diagnosis)


@router.get(
    "/report",
    response_class=HTMLResponse,
    responses={200: {"content": {"text/html": {"schema": {"type": "string"}}}}},
)
def get_report(campaign: RowNumber, database: DatabaseDependency) -> Response:
    """Return the diagnosis for the plant engineer, as one page that stands alone."""
    content = _file(database, campaign, REPORT)
    return HTMLResponse(content, headers=_ALONE)


@router.get(
    "/next_poses",
    response_class=Response,
    responses={200: {"content": {"text/csv": {"schema": {"type": "string"}}}}},
)
def get_next_poses(campaign: RowNumber, database: DatabaseDependency) -> Response:
    """Return the poses that would best tell the leading causes apart."""
    return Response(_file(database, campaign, NEXT_POSES), media_type="text/csv")


@router.post("/identification", status_code=HTTPStatus.ACCEPTED, response_model=Computation)
def identify_again(
    campaign: RowNumber,
    once: OnceDependency,
    queue: QueueDependency,
    wish: Annotated[IdentificationWish | None, Body()] = None,
) -> Response:
    """Identify again with other settings, as a job; makes a new version of the parameters."""
    wanted = wish or IdentificationWish()
    return once.answer(
        lambda session: repeats.ask_identification(session, queue, campaign, wanted),
        HTTPStatus.ACCEPTED,
    )


@router.post("/diagnosis", status_code=HTTPStatus.ACCEPTED, response_model=Computation)
def diagnose_again(campaign: RowNumber, once: OnceDependency, queue: QueueDependency) -> Response:
    """Diagnose again, as a job."""
    return once.answer(
        lambda session: repeats.ask_diagnosis(session, queue, campaign), HTTPStatus.ACCEPTED
    )


@router.get("/computations/{number}")
def get_computation(
    campaign: RowNumber, number: RowNumber, database: DatabaseDependency
) -> Computation:
    """How a computation that was asked for again stands."""
    with database.read() as session:
        return repeats.shown(session, campaign, number)


@router.delete("/computations/{number}")
def cancel_computation(
    campaign: RowNumber, number: RowNumber, database: DatabaseDependency, queue: QueueDependency
) -> Computation:
    """End a computation that is under way; the results before stay."""
    with database.write() as session:
        return repeats.cancel(session, queue, campaign, number)


def _document(database: Database, campaign: int, kind: ResultKind) -> Response:
    with database.read() as session:
        document = results.newest(session, campaign, kind).document
    return JSONResponse(document)


def _file(database: Database, campaign: int, name: str) -> bytes:
    with database.read() as session:
        return results.diagnosis_file(session, campaign, name)
