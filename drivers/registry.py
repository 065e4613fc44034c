"""Which drivers there are, by the names that a cell's settings use.

A driver's module is loaded when it is chosen and not before: a client library that is missing on
this system matters only to those who choose its driver.
"""

import importlib
from typing import cast

from drivers.errors import DriverError
from drivers.interfaces import Robot, StageSensor, TemperatureProbe, Tracker

ROBOTS = {
    "modbus": "drivers.devices.modbus:ModbusRobot",
    "mock": "drivers.devices.mock_robot:MockRobot",
    "ur_rtde": "drivers.devices.ur_rtde:UrRtde",
}
"""Each is called with (address, n_joints)."""

TRACKERS = {
    "geocom": "drivers.devices.geocom:GeoComTracker",
    "mock": "drivers.devices.mock_tracker:MockTracker",
    "ndi": "drivers.devices.ndi:NdiTracker",
    "relay": "drivers.devices.relay:RelayTracker",
}
"""Each is called with (address)."""

STAGE_SENSORS = {
    "dimetix": "drivers.devices.dimetix:DimetixRangefinder",
    "lika": "drivers.devices.lika:LikaEncoder",
    "magnescale": "drivers.devices.magnescale:MagnescaleGauge",
    "mock": "drivers.devices.mock_stage:MockStageSensor",
}
"""Each is called with (address, sensor)."""

TEMPERATURE_PROBES = {
    "mock": "drivers.devices.mock_temperature:MockTemperature",
    "modbus_temperature": "drivers.devices.modbus_temperature:ModbusTemperature",
}
"""Each is called with (address)."""


def open_robot(driver: str, address: str, n_joints: int) -> Robot:
    """Make the robot driver of this name for an address; its `connect` is yet to be called.

    Raises
    ------
    DriverError
        If there is no such driver, or its client library is missing on this system.
    """
    return cast("Robot", _load("robot", ROBOTS, driver)(address, n_joints))


def open_tracker(driver: str, address: str) -> Tracker:
    """Make the tracker driver of this name; like `open_robot`."""
    return cast("Tracker", _load("tracker", TRACKERS, driver)(address))


def open_stage_sensor(driver: str, address: str, sensor: str) -> StageSensor:
    """Make the driver of this name for one stage sensor; like `open_robot`."""
    return cast("StageSensor", _load("stage sensor", STAGE_SENSORS, driver)(address, sensor))


def open_temperature_probe(driver: str, address: str) -> TemperatureProbe:
    """Make the temperature probe driver of this name; like `open_robot`."""
    made = _load("temperature probe", TEMPERATURE_PROBES, driver)(address)
    return cast("TemperatureProbe", made)


def _load(kind: str, drivers: dict[str, str], driver: str) -> type:
    if driver not in drivers:
        raise DriverError(
            f"{kind} {driver}",
            "open",
            f"there is no {kind} driver {driver!r}; choose one of {', '.join(sorted(drivers))}",
        )
    module, _, name = drivers[driver].partition(":")
    try:
        return cast("type", getattr(importlib.import_module(module), name))
    except ModuleNotFoundError as fault:
        raise DriverError(
            f"{kind} {driver}",
            "open",
            f"the library {fault.name} is not installed on this system; install it or choose "
            "another driver",
        ) from fault
