"""Cells in the database."""

from sqlalchemy import exists, select
from sqlalchemy.orm import Session

from drivers.registry import ROBOTS as ROBOT_DRIVERS
from drivers.registry import STAGE_SENSORS, TEMPERATURE_PROBES
from drivers.registry import TRACKERS as TRACKER_DRIVERS
from robocal.errors import BadInput
from robocal.robots.library import ROBOTS, load_robot
from service.cells.bounds import narrowed
from service.cells.models import Cell, CellChange, Cells, CellSettings, NewCell
from service.clock import utc_now
from service.db.models import CampaignRow, CellRow, JobRow
from service.errors import Conflict, NotFound, Unusable

_OPEN = ("queued", "running", "paused")


def create(session: Session, wanted: NewCell) -> Cell:
    """Store a new cell."""
    _refuse_unknown(wanted)
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


def page(session: Session, after: str | None, limit: int) -> Cells:
    """Cells by name, a page at a time."""
    query = select(CellRow).order_by(CellRow.name).limit(limit)
    if after is not None:
        query = query.where(CellRow.name > after)
    found = [shown(row) for row in session.scalars(query)]
    return Cells(cells=found, next_after=found[-1].name if len(found) == limit else None)


def find(session: Session, name: str) -> CellRow:
    """Return the row of a cell; raises `NotFound`."""
    row = session.get(CellRow, name)
    if row is None:
        raise NotFound(f"There is no cell named '{name}'.")
    return row


def change(session: Session, name: str, wanted: CellChange) -> Cell:
    """Replace sections of a cell that no campaign uses; it has to be armed again."""
    row = find(session, name)
    busy = session.scalar(
        select(CampaignRow.id).where(CampaignRow.cell == name, CampaignRow.state.in_(_OPEN))
    )
    if busy is not None:
        raise Conflict(
            f"Campaign {busy} uses cell '{name}'; change the cell when it has ended, or abort it."
        )
    before = settings_of(row)
    given = wanted.model_dump(mode="json", include=wanted.model_fields_set)
    for section in ("robot", "tracker", "stage_sensors", "limits"):
        if section in given and given[section] is None:
            raise Unusable(f"body {section}: a cell cannot be without; leave the field out.")
    changed = NewCell.model_validate(before.model_dump(mode="json") | given)
    _refuse_unknown(changed)
    if changed.robot.model != before.robot.model and _was_used(session, name):
        raise Conflict(
            f"Cell '{name}' has campaigns with a {before.robot.model}; "
            f"make a new cell for the {changed.robot.model}."
        )
    row.document = changed.model_dump(mode="json")
    row.armed = False
    session.flush()
    return shown(row)


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
    """Return what was given when the cell was made or last changed."""
    return NewCell.model_validate(row.document)


def shown(row: CellRow) -> Cell:
    """Show a cell as it goes over HTTP."""
    return Cell(**settings_of(row).model_dump(), armed=row.armed, created=row.created)


def _was_used(session: Session, name: str) -> bool:
    return session.scalar(select(exists().where(CampaignRow.cell == name))) is True


def _refuse_unknown(wanted: CellSettings) -> None:
    """Refuse drivers, robots and joints that are not known; raises `Unusable`."""
    _one_of("robot.model", wanted.robot.model, list(ROBOTS))
    _one_of("robot.driver", wanted.robot.driver, list(ROBOT_DRIVERS))
    _one_of("tracker.driver", wanted.tracker.driver, list(TRACKER_DRIVERS))
    if wanted.temperature_probe is not None:
        driver = wanted.temperature_probe.driver
        _one_of("temperature_probe.driver", driver, list(TEMPERATURE_PROBES))
    for number, sensor in enumerate(wanted.stage_sensors):
        _one_of(f"stage_sensors.{number}.driver", sensor.driver, list(STAGE_SENSORS))
    try:
        narrowed(load_robot(wanted.robot.model), wanted.limits)
    except BadInput as error:
        raise Unusable(str(error)) from None


def _one_of(field: str, value: str, known: list[str]) -> None:
    if value not in known:
        raise Unusable(f"body {field}: '{value}' is not known; known are {', '.join(known)}.")
