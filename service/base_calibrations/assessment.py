"""What the touches say so far: computed in a process of its own once a revision, and stored."""

import re
import threading
from collections.abc import Sequence
from typing import Any

from sqlalchemy.orm import Session

from service.base_calibrations import store
from service.base_calibrations.guidance import next_touch, two_by_each
from service.base_calibrations.models import BaseCalibration, Role, State, Touch
from service.base_calibrations.stage_files import stage_files
from service.db.base_calibration_tables import BaseCalibrationRow
from service.db.engine import Database
from service.procedures.computation import NumericsFailed, compute
from service.procedures.patience import patience

_LINES = re.compile(r"lines ([\d, ]+) of the touches")
_ONE_AT_A_TIME = threading.Lock()
"""Two pages that look at once do not compute the same twice."""

Json = dict[str, Any]


def shown(database: Database, number: int) -> BaseCalibration:
    """Show a base calibration with its assessment, which is computed where it is missing."""
    with database.read() as session:
        row = store.find(session, number)
        counted = _counted(store.touches_of(session, row))
        missing = row.assessed != row.revision and two_by_each(counted)
    if missing:
        with _ONE_AT_A_TIME:
            _assess(database, number)
    with database.read() as session:
        return shown_row(session, store.find(session, number))


def files_of(session: Session, row: BaseCalibrationRow) -> dict[str, bytes]:
    """Return the stage files of a base calibration."""
    geometries = {role: store.robot_of(row, role).geometry for role in Role}
    return stage_files(store.settings_of(row), geometries, store.touches_of(session, row))


def with_touch_numbers(document: Json, touches: Sequence[Touch]) -> Json:
    """Name touches by their numbers where the numerics name lines of touches.csv."""
    # The header is line 1; voided touches are not in the file.
    numbers = {line: touch.number for line, touch in enumerate(_counted(touches), start=2)}

    def renamed(match: re.Match[str]) -> str:
        lines = [int(line) for line in match[1].split(",")]
        return f"touches {', '.join(str(numbers[line]) for line in lines)}"

    return {
        **document,
        "undetermined": [
            {**entry, "direction": _LINES.sub(renamed, entry["direction"])}
            for entry in document["undetermined"]
        ],
        "faults": [
            {**fault, "touches": [numbers[line] for line in fault["lines"]]}
            for fault in document["faults"]
        ],
    }


def _assess(database: Database, number: int) -> None:
    with database.read() as session:
        row = store.find(session, number)
        revision, touches = row.revision, store.touches_of(session, row)
        if row.assessed == revision:
            return
        files = files_of(session, row)
    try:
        found = compute("assess_base", files, {}, patience())
        document: Json = {"answer": with_touch_numbers(found, touches), "no_answer": ""}
    except NumericsFailed as error:
        document = {"answer": None, "no_answer": str(error)}
    with database.write() as session:
        row = store.find(session, number)
        # A touch taken meanwhile makes this one old; it is computed again when asked for.
        row.assessment, row.assessed = document, revision


def shown_row(session: Session, row: BaseCalibrationRow) -> BaseCalibration:
    """Show a base calibration with the assessment that is stored, where it is not old."""
    touches = store.touches_of(session, row)
    counted, settings = _counted(touches), store.settings_of(row)
    current = row.assessed == row.revision and row.assessment is not None
    document = row.assessment if current and row.assessment is not None else {}
    answer = document.get("answer")
    touching = row.state == State.touching
    return BaseCalibration(
        id=row.id,
        name=row.name,
        state=State(row.state),
        revision=row.revision,
        settings=settings,
        touches=touches,
        may_finish=touching and two_by_each(counted),
        next_touch=next_touch(settings.stage, counted, answer) if touching else None,
        assessment=answer,
        no_answer=document.get("no_answer", ""),
        version=store.version_made(session, row.id),
        created=row.created,
        finished=row.finished,
    )


def _counted(touches: Sequence[Touch]) -> list[Touch]:
    return [touch for touch in touches if touch.voided is None]
