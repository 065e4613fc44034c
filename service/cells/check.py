"""Connection test: talk to each device of a cell once, move nothing."""

from contextlib import closing

from drivers.errors import DriverError
from drivers.registry import (
    open_robot,
    open_stage_sensor,
    open_temperature_probe,
    open_tracker,
)
from robocal.robots.library import load_robot
from service.cells.models import (
    CellCheck,
    DeviceCheck,
    NewCell,
    StageSensorSettings,
    TemperatureProbeSettings,
)


def check(cell: NewCell) -> CellCheck:
    """Connect to every device; one that does not answer is a result, not an error."""
    robot, tracker = _robot(cell), _tracker(cell)
    probe = None if cell.temperature_probe is None else _probe(cell.temperature_probe)
    sensors = {sensor.name: _stage_sensor(sensor) for sensor in cell.stage_sensors}
    every = [robot, tracker, *([] if probe is None else [probe]), *sensors.values()]
    return CellCheck(
        cell=cell.name,
        ok=all(device.ok for device in every),
        robot=robot,
        tracker=tracker,
        temperature_probe=probe,
        stage_sensors=sensors,
    )


def _robot(cell: NewCell) -> DeviceCheck:
    n_joints = load_robot(cell.robot.model).n_joints
    try:
        with closing(open_robot(cell.robot.driver, cell.robot.address, n_joints)) as robot:
            robot.connect()
            state = robot.state()
    except DriverError as error:
        return DeviceCheck(ok=False, detail=str(error))
    sentence = f"{len(state.joints)} joints, safety state {state.safety}"
    return DeviceCheck(ok=True, detail=f"{sentence}; {state.advice}" if state.advice else sentence)


def _tracker(cell: NewCell) -> DeviceCheck:
    try:
        with closing(open_tracker(cell.tracker.driver, cell.tracker.address)) as tracker:
            tracker.connect()
    except DriverError as error:
        return DeviceCheck(ok=False, detail=str(error))
    return DeviceCheck(ok=True, detail="ready")


def _probe(settings: TemperatureProbeSettings) -> DeviceCheck:
    try:
        with closing(open_temperature_probe(settings.driver, settings.address)) as probe:
            probe.connect()
            reading = probe.read()
    except DriverError as error:
        return DeviceCheck(ok=False, detail=str(error))
    return DeviceCheck(ok=True, detail=f"{reading.temperature_degc:.1f} degC")


def _stage_sensor(settings: StageSensorSettings) -> DeviceCheck:
    try:
        with closing(open_stage_sensor(settings.driver, settings.address, settings.name)) as sensor:
            sensor.connect()
            reading = sensor.read()
    except DriverError as error:
        return DeviceCheck(ok=False, detail=str(error))
    return DeviceCheck(ok=True, detail=f"reads {reading.value:.6f} (m or rad)")
