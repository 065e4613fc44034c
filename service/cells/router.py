"""REST: cells."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Query, Response
from pydantic import AfterValidator

from service.cells import store
from service.cells.check import check
from service.cells.models import Cell, CellChange, CellCheck, Cells, NewCell
from service.dependencies import DatabaseDependency, OnceDependency, PageSize
from service.plain_text import all_plain

router = APIRouter(prefix="/cells", tags=["cells"])


@router.post("", status_code=HTTPStatus.CREATED, response_model=Cell)
def create_cell(
    wanted: Annotated[NewCell, AfterValidator(all_plain)], once: OnceDependency
) -> Response:
    """Create a cell."""
    return once.answer(lambda session: store.create(session, wanted), HTTPStatus.CREATED)


@router.get("")
def list_cells(
    database: DatabaseDependency,
    after: Annotated[str | None, Query(description="cells behind this name")] = None,
    limit: PageSize = 200,
) -> Cells:
    """Cells by name, a page at a time."""
    with database.read() as session:
        return store.page(session, after, limit)


@router.get("/{cell}")
def get_cell(cell: str, database: DatabaseDependency) -> Cell:
    """One cell."""
    with database.read() as session:
        return store.shown(store.find(session, cell))


@router.patch("/{cell}", response_model=Cell)
def change_cell(
    cell: str, wanted: Annotated[CellChange, AfterValidator(all_plain)], once: OnceDependency
) -> Response:
    """Replace addresses, limits or instruments while no campaign is open; disarms the cell."""
    return once.answer(lambda session: store.change(session, cell, wanted))


@router.post("/{cell}/check", response_model=CellCheck)
def check_cell(cell: str, database: DatabaseDependency, once: OnceDependency) -> Response:
    """Connect to robot, tracker, probe and stage sensors; nothing moves."""
    earlier = once.earlier()
    if earlier is not None:
        return earlier
    with database.read() as session:
        settings = store.free_for_check(session, cell)
    found = check(settings)
    return once.answer(lambda session: found)


@router.post("/{cell}/arm", response_model=Cell)
def arm_cell(cell: str, once: OnceDependency) -> Response:
    """Allow motion until the campaign ends: an operator has looked at the cell."""
    return once.answer(lambda session: store.arm(session, cell))


@router.post("/{cell}/disarm", response_model=Cell)
def disarm_cell(cell: str, once: OnceDependency) -> Response:
    """Forbid motion; a running campaign stops and pauses."""
    return once.answer(lambda session: store.disarm(session, cell))
