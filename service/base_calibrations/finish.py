"""From the touches to a version of the transform."""

from dataclasses import dataclass
from importlib.metadata import version as software
from typing import Any

from sqlalchemy.orm import Session

from service.base_calibrations import assessment, store, transforms
from service.base_calibrations.guidance import two_by_each
from service.base_calibrations.models import Finished, State
from service.base_calibrations.stage_files import bundle_sha256
from service.clock import utc_now
from service.db.engine import Database
from service.errors import Conflict, Unusable
from service.procedures.computation import NumericsFailed, compute
from service.procedures.patience import patience

DRAWS, SEED = 2_000, 1
"""Of the Monte Carlo, as `robocal basecal` takes them by default."""

Json = dict[str, Any]


@dataclass(frozen=True)
class Computed:
    """A result that is not stored yet, and the touches that it is of."""

    number: int
    revision: int
    document: Json
    bundle_sha256: str


def computed(database: Database, number: int) -> Computed:
    """Compute basecal.json of the touches; raises `Conflict` or `Unusable`."""
    with database.read() as session:
        row = store.open_for_touches(session, number)
        touches = store.touches_of(session, row)
        if not two_by_each([touch for touch in touches if touch.voided is None]):
            raise Conflict(
                f"Base calibration {number} needs two touches by the master and two by the slave "
                "without the stage being moved between; take those that it names as next."
            )
        revision, files = row.revision, assessment.files_of(session, row)
    request = {"draws": DRAWS, "seed": SEED}
    try:
        document = compute("calibrate_base", files, request, patience())
    except NumericsFailed as error:
        raise Unusable(str(error)) from error
    numbered = assessment.with_touch_numbers(document, touches)
    return Computed(number, revision, numbered, bundle_sha256(files))


def finish(session: Session, found: Computed, person: str) -> Finished:
    """Store the result as a candidate; the touches stay as they are from now on."""
    row = store.open_for_touches(session, found.number)
    if row.revision != found.revision:
        raise Conflict(
            f"A touch of base calibration {found.number} was taken or voided meanwhile; look at "
            "it and finish again."
        )
    row.state, row.finished = State.finished, utc_now()
    made = transforms.add_candidate(
        session,
        name=row.name,
        calibration=row.id,
        document=found.document,
        bundle_sha256=found.bundle_sha256,
        software_version=software("robocal"),
        settings={"draws": DRAWS, "seed": SEED},
        person=person,
    )
    return Finished(id=row.id, name=row.name, version=made.version)
