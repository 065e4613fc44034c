"""Cells in the database."""

from sqlalchemy import select
from sqlalchemy.orm import Session

from drivers.registry import ROBOTS as ROBOT_DRIVERS
from drivers.registry import TRACKERS as TRACKER_DRIVERS
from robocal.robots.library import ROBOTS
from service.cells.models import Cell, NewCell
from service.clock import utc_now
from service.db.models import CellRow, JobRow
from service.errors import Conflict, NotFound, Unusable


def create(session: Session, wanted: NewCell) -> Cell:
    """Store a new cell."""
    _one_of("robot.model", wanted.robot.model, list(ROBOTS))
    _one_of("robot.driver", wanted.robot.driver, list(ROBOT_DRIVERS))
    _one_of("tracker.driver", wanted.tracker.driver, list(TRACKER_DRIVERS))
    if session.get(CellRow, wanted.name) is not None:
        raise Conflict(f"There is a cell named '{wanted.name}' already; choose another name.")
    row = CellRow(
        name=wanted.name, document=wanted.model_dump(mode="json"), armed=False, created=utc_now()
    )
    session.add(row)
    session.flush()
    return shown(row)


def all_cells(session: Session) -> list[Cell]:
    """Every cell, by name."""
    return [shown(row) for row in session.scalars(select(CellRow).order_by(CellRow.name))]


def find(session: Session, name: str) -> CellRow:
    """Return the row of a cell; raises `NotFound`."""
    row = session.get(CellRow, name)
    if row is None:
        raise NotFound(f"There is no cell named '{name}'.")
    return row


def arm(session: Session, name: str) -> Cell:
    """Allow motion, as an operator wishes."""
    row = find(session, name)
    row.armed = True
    return shown(row)


def disarm(session: Session, name: str) -> Cell:
    """Motion is no longer allowed; a running campaign stops and pauses."""
    row = find(session, name)
    row.armed = False
    return shown(row)


def free_for_check(session: Session, name: str) -> NewCell:
    """Return the settings of a cell whose devices nobody uses at this moment."""
    row = find(session, name)
    busy = session.scalar(
        select(JobRow.campaign).where(
            JobRow.cell == name, JobRow.state == "running", JobRow.kind == "collect"
        )
    )
    if busy is not None:
        raise Conflict(
            f"Campaign {busy} is using the devices of cell '{name}'; check it afterwards."
        )
    return settings_of(row)


def settings_of(row: CellRow) -> NewCell:
    """Return what was given when the cell was made."""
    return NewCell.model_validate(row.document)


def shown(row: CellRow) -> Cell:
    """Show a cell as it goes over HTTP."""
    return Cell(**settings_of(row).model_dump(), armed=row.armed, created=row.created)


def _one_of(field: str, value: str, known: list[str]) -> None:
    if value not in known:
        raise Unusable(f"body {field}: '{value}' is not known; known are {', '.join(known)}.")
