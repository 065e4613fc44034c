"""REST: base-to-base calibrations with the sensing stage."""

from http import HTTPStatus
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request, Response
from pydantic import AfterValidator

from service.base_calibrations import assessment, finish, store, touching, transforms
from service.base_calibrations.live import LiveStages
from service.base_calibrations.models import (
    BaseCalibration,
    BaseCalibrations,
    Finished,
    NewBaseCalibration,
    NewTouch,
    SensorViews,
    Touch,
    Voiding,
)
from service.base_calibrations.stage_files import zipped
from service.dependencies import DatabaseDependency, OnceDependency, PersonDependency, RowNumber
from service.plain_text import all_plain

router = APIRouter(prefix="/base-calibrations", tags=["base calibrations"])


def _stages(request: Request) -> LiveStages:
    stages: LiveStages = request.app.state.stages
    return stages


StagesDependency = Annotated[LiveStages, Depends(_stages)]


@router.post("", status_code=HTTPStatus.CREATED, response_model=BaseCalibration)
def create_base_calibration(
    wanted: Annotated[NewBaseCalibration, AfterValidator(all_plain)],
    once: OnceDependency,
    database: DatabaseDependency,
) -> Response:
    """Start a base calibration; nothing is read or driven yet."""
    return once.answer(
        lambda session: assessment.shown_row(session, store.create(session, wanted)),
        HTTPStatus.CREATED,
    )


@router.get("")
def list_base_calibrations(database: DatabaseDependency) -> BaseCalibrations:
    """List base calibrations, newest first."""
    with database.read() as session:
        return BaseCalibrations(base_calibrations=store.newest(session))


@router.get("/{number}")
def get_base_calibration(number: RowNumber, database: DatabaseDependency) -> BaseCalibration:
    """Touches so far, what they say, and the touch to make next."""
    return assessment.shown(database, number)


@router.get("/{number}/sensors")
def get_stage_sensors(
    number: RowNumber, database: DatabaseDependency, stages: StagesDependency
) -> SensorViews:
    """Mean and spread of the stage's sensors at this moment; asking keeps them polled."""
    with database.read() as session:
        settings = store.settings_of(store.find(session, number))
    return touching.views(stages.of(settings.stage))


@router.post("/{number}/touches", status_code=HTTPStatus.CREATED, response_model=Touch)
def take_touch(
    number: RowNumber,
    wanted: NewTouch,
    once: OnceDependency,
    database: DatabaseDependency,
    stages: StagesDependency,
) -> Response:
    """Read robot and stage while the needle sits in the cup; nothing is driven."""
    earlier = once.earlier()
    if earlier is not None:
        return earlier
    taken = touching.read_touch(database, stages, number, wanted)
    return once.answer(
        lambda session: store.add_touch(session, number, wanted, taken), HTTPStatus.CREATED
    )


@router.post("/{number}/touches/{touch}/void", response_model=Touch)
def void_touch(number: RowNumber, touch: RowNumber, why: Voiding, once: OnceDependency) -> Response:
    """Let a touch count no more; it is kept with the reason."""
    return once.answer(lambda session: store.void_touch(session, number, touch, why.reason))


@router.post("/{number}/finish", response_model=Finished)
def finish_base_calibration(
    number: RowNumber,
    once: OnceDependency,
    database: DatabaseDependency,
    person: PersonDependency,
) -> Response:
    """Compute basecal.json and store it as a candidate; the touches stay as they are."""
    earlier = once.earlier()
    if earlier is not None:
        return earlier
    found = finish.computed(database, number)
    return once.answer(lambda session: finish.finish(session, found, person))


@router.get("/{number}/result")
def get_result(number: RowNumber, database: DatabaseDependency) -> dict[str, Any]:
    """Return basecal.json."""
    with database.read() as session:
        store.find(session, number)
        return dict(transforms.of_calibration(session, number).document)


@router.get("/{number}/bundle", response_class=Response)
def get_stage_files(number: RowNumber, database: DatabaseDependency) -> Response:
    """Return stage.yaml, touches.csv and both robots as .zip, for `robocal basecal`."""
    with database.read() as session:
        files = assessment.files_of(session, store.find(session, number))
    name = f"base-calibration-{number}.zip"
    return Response(
        zipped(files),
        media_type="application/zip",
        headers={"Content-Disposition": f'attachment; filename="{name}"'},
    )
