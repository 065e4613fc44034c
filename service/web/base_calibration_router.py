"""Pages of base-to-base calibrations: all of them, and the guided touches of one."""

from fastapi import APIRouter
from fastapi.responses import HTMLResponse

from drivers.registry import ROBOTS as ROBOT_DRIVERS
from drivers.registry import STAGE_SENSORS
from robocal.robots.library import ROBOTS
from service.base_calibrations import store
from service.dependencies import DatabaseDependency, RowNumber
from service.web.rendering import page

router = APIRouter(include_in_schema=False)

SENSORS = ("slide", "rod_angle", "rod_length")
RANGES = (("slide", "mm"), ("rod_angle", "deg"), ("rod_length", "mm"))


@router.get("/base-calibrations")
def base_calibrations_page(database: DatabaseDependency) -> HTMLResponse:
    """All base calibrations, and the form that starts one."""
    with database.read() as session:
        heads = store.newest(session)
    return page(
        "base_calibrations.html",
        heads=heads,
        models=sorted(ROBOTS),
        robot_drivers=sorted(ROBOT_DRIVERS),
        sensor_drivers=sorted(STAGE_SENSORS),
        sensors=SENSORS,
        ranges=RANGES,
    )


@router.get("/base-calibrations/{number}")
def base_calibration_page(number: RowNumber, database: DatabaseDependency) -> HTMLResponse:
    """Guide an operator through the touches."""
    with database.read() as session:
        row = store.find(session, number)
        name, created = row.name, row.created
    return page("base_calibration.html", number=number, name=name, created=created, sensors=SENSORS)
