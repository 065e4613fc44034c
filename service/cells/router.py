"""REST: cells."""

from http import HTTPStatus

from fastapi import APIRouter, Response

from service.cells import store
from service.cells.check import check
from service.cells.models import Cell, CellCheck, Cells, NewCell
from service.dependencies import DatabaseDependency, OnceDependency

router = APIRouter(prefix="/cells", tags=["cells"])


@router.post("", status_code=HTTPStatus.CREATED, response_model=Cell)
def create_cell(wanted: NewCell, once: OnceDependency) -> Response:
    """Create a cell."""
    return once.answer(lambda session: store.create(session, wanted), HTTPStatus.CREATED)


@router.get("")
def list_cells(database: DatabaseDependency) -> Cells:
    """All cells."""
    with database.read() as session:
        return Cells(cells=store.all_cells(session))


@router.get("/{cell}")
def get_cell(cell: str, database: DatabaseDependency) -> Cell:
    """One cell."""
    with database.read() as session:
        return store.shown(store.find(session, cell))


@router.post("/{cell}/check", response_model=CellCheck)
def check_cell(cell: str, database: DatabaseDependency, once: OnceDependency) -> Response:
    """Connect to the robot and the tracker; nothing moves."""
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
