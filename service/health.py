"""Whether the service lives, whether it can do its work, and its figures for a monitor."""

from http import HTTPStatus
from typing import Literal

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel

from service.dependencies import DatabaseDependency, QueueDependency, SettingsDependency
from service.metrics.figures import CONTENT_TYPE, figures
from service.readiness import Check, checks

router = APIRouter(tags=["health"])


class Health(BaseModel):
    """A short word on how the service does."""

    status: Literal["alive"]


class Readiness(BaseModel):
    """Whether everything that the service needs is there."""

    status: Literal["ready", "not ready"]
    checks: list[Check]


@router.get("/healthz")
def healthz() -> Health:
    """Say that the process answers."""
    return Health(status="alive")


@router.get("/readyz", responses={503: {"model": Readiness, "description": "Something is missing"}})
def readyz(
    database: DatabaseDependency,
    queue: QueueDependency,
    settings: SettingsDependency,
    response: Response,
) -> Readiness:
    """Say that the database can be written, a worker lives, and the disk has room."""
    found = checks(database, queue, settings)
    if all(check.passed for check in found):
        return Readiness(status="ready", checks=found)
    response.status_code = HTTPStatus.SERVICE_UNAVAILABLE
    return Readiness(status="not ready", checks=found)


@router.get("/metrics", response_class=Response)
def metrics(request: Request) -> Response:
    """Figures in the text format of Prometheus."""
    return Response(figures(request.app), media_type=CONTENT_TYPE)
