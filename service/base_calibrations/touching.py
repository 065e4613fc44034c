"""Take a touch for a base calibration, and say what its sensors show."""

import time

from service.base_calibrations import store
from service.base_calibrations.live import (
    FRESH_S,
    STEADY,
    WINDOW,
    LiveSensor,
    LiveStage,
    LiveStages,
    SensorSetting,
    spread_of,
)
from service.base_calibrations.models import NewTouch, SensorView, SensorViews
from service.cells import store as cells
from service.db.engine import Database
from service.errors import Conflict
from service.procedures.calibrate_base import TakenTouch, TouchingArm, TouchRefused, take_touch


def read_touch(database: Database, stages: LiveStages, number: int, wanted: NewTouch) -> TakenTouch:
    """Read robot and sensors; raises `Conflict` with what to do where that is not possible."""
    with database.read() as session:
        row = store.open_for_touches(session, number)
        robot = store.robot_of(row, wanted.robot)
        if robot.cell is not None:
            cells.free_for_check(session, robot.cell)
        settings = store.settings_of(row)
    arm = TouchingArm(wanted.robot, robot.driver, robot.address, len(robot.joint_units))
    try:
        with stages.taking(number):
            return take_touch(arm, stages.of(settings.stage))
    except TouchRefused as refusal:
        raise Conflict(str(refusal)) from refusal


def views(stage: LiveStage) -> SensorViews:
    """Show mean and spread of what every sensor read of late."""
    return SensorViews(sensors=[_view(*entry) for entry in stage.sensors])


def _view(setting: SensorSetting, sensor: LiveSensor) -> SensorView:
    readings, problem = sensor.look()
    window = readings[-WINDOW:]
    values = [setting.on_stage(reading.value) for reading in window]
    age_s = time.monotonic() - window[-1].begun_s if window else None
    spread, allowed = spread_of(values), STEADY * setting.sigma
    fresh = age_s is not None and age_s < FRESH_S
    return SensorView(
        sensor=setting.name,
        unit=setting.unit,
        mean=sum(values) / len(values) / setting.scale if values else None,
        spread=spread / setting.scale if values else None,
        allowed_spread=allowed / setting.scale,
        readings=len(window),
        age_s=age_s,
        steady=fresh and len(window) == WINDOW and spread <= allowed and not problem,
        problem=problem,
    )
