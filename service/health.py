"""Whether the service lives, and whether it can do its work."""

from fastapi import APIRouter
from pydantic import BaseModel
from sqlalchemy import text

from service.dependencies import DatabaseDependency

router = APIRouter(tags=["health"])


class Health(BaseModel):
    """A short word on how the service does."""

    status: str


@router.get("/healthz")
def healthz() -> Health:
    """Say that the process answers."""
    return Health(status="alive")


@router.get("/readyz")
def readyz(database: DatabaseDependency) -> Health:
    """Say that the database answers too."""
    with database.read() as session:
        session.execute(text("SELECT count(*) FROM campaign"))
    return Health(status="ready")
