"""The stage's sensors, polled live: one thread a sensor, as long as somebody looks.

A serial line has one reader, so whoever wants a reading (the page, a touch that is taken) asks the
thread that has the line open. It lets go of the line when nobody has asked for a while.
"""

import math
import statistics
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from drivers.errors import DriverError
from drivers.registry import open_stage_sensor
from service.base_calibrations.models import AngleSensor, LengthSensor, StageSettings
from service.errors import Conflict

WINDOW = 5
"""Readings that mean and spread are taken of, live and in a touch."""
STEADY = 3.0
"""Most spread that a sensor at rest may have, in its standard uncertainties."""
FRESH_S = 6.0
"""Age at which a reading is stale; a rangefinder on a dark target takes 4 s for one."""
IDLE_S = 10.0
"""How long the line is kept open when nobody asks."""
PERIOD_S = 0.05
RETRY_S = 1.0
_FAREWELL_S = 2.0
_KEPT = 64


@dataclass(frozen=True)
class SensorSetting:
    """How to reach one sensor, and what its reading means. SI units."""

    name: str
    unit: str
    """Of the file: mm or deg."""
    scale: float
    """SI units in one file unit."""
    driver: str
    address: str
    sign: float
    offset: float
    sigma: float

    def on_stage(self, reading: float) -> float:
        """Take a sensor's reading to the stage's scale."""
        return self.sign * reading + self.offset


@dataclass(frozen=True)
class SensorReading:
    """One reading as the sensor gives it. SI units."""

    value: float
    begun_s: float
    """Host's monotonic clock when it was asked for."""
    clock_s: float
    """The instrument's clock where it has one."""


def sensor_settings(stage: StageSettings) -> tuple[SensorSetting, SensorSetting, SensorSetting]:
    """Return slide, rod angle, rod length."""
    sensors = stage.sensors
    assert sensors is not None, "resolved when the base calibration was made"
    return (
        _length("slide", sensors.slide, stage.sigma_slide_mm),
        _angle("rod_angle", sensors.rod_angle, stage.sigma_angle_mrad),
        _length("rod_length", sensors.rod_length, stage.sigma_rod_mm),
    )


def _length(name: str, sensor: LengthSensor, sigma_mm: float) -> SensorSetting:
    sign = -1.0 if sensor.reversed else 1.0
    offset = sensor.offset_mm * 1e-3
    return SensorSetting(
        name, "mm", 1e-3, sensor.driver, sensor.address, sign, offset, sigma_mm * 1e-3
    )


def _angle(name: str, sensor: AngleSensor, sigma_mrad: float) -> SensorSetting:
    sign = -1.0 if sensor.reversed else 1.0
    offset, degree = math.radians(sensor.offset_deg), math.pi / 180
    return SensorSetting(
        name, "deg", degree, sensor.driver, sensor.address, sign, offset, sigma_mrad * 1e-3
    )


class LiveSensor:
    """One sensor and the thread that reads it."""

    def __init__(self, name: str, driver: str, address: str) -> None:
        self._name, self._driver, self._address = name, driver, address
        self._readings: deque[SensorReading] = deque(maxlen=_KEPT)
        self._problem = ""
        self._asked_s = time.monotonic()
        self._waiting = 0
        """Who waits for readings wants the line however long a reading takes."""
        self._news = threading.Condition()
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None

    def look(self) -> tuple[list[SensorReading], str]:
        """Return the readings of late and what keeps the sensor from being read."""
        with self._news:
            self._ask()
            return list(self._readings), self._problem

    def await_readings(self, count: int, since_s: float, until_s: float) -> list[SensorReading]:
        """Wait for readings asked for after `since_s`; fewer than `count` past `until_s`."""
        with self._news:
            self._waiting += 1
            try:
                while True:
                    self._ask()
                    new = [reading for reading in self._readings if reading.begun_s >= since_s]
                    left_s = until_s - time.monotonic()
                    if len(new) >= count or left_s <= 0:
                        return new[:count]
                    self._news.wait(left_s)
            finally:
                self._waiting -= 1

    def close(self) -> None:
        """Let go of the line."""
        self._ending.set()
        with self._news:
            thread = self._thread
        if thread is not None:
            # A daemon: a sensor that is just being asked may keep its answer.
            thread.join(_FAREWELL_S)

    def _ask(self) -> None:
        self._asked_s = time.monotonic()
        if self._thread is None and not self._ending.is_set():
            self._thread = threading.Thread(
                target=self._run, daemon=True, name=f"sensor {self._name}"
            )
            self._thread.start()

    def _run(self) -> None:
        while True:
            try:
                self._poll()
            except DriverError as error:
                with self._news:
                    self._problem = str(error)
                self._ending.wait(RETRY_S)
            with self._news:
                if self._unwanted():
                    self._thread = None
                    self._readings.clear()
                    return

    def _poll(self) -> None:
        """Read until nobody asks any more."""
        sensor = open_stage_sensor(self._driver, self._address, self._name)
        try:
            sensor.connect()
            while not self._unwanted():
                begun_s = time.monotonic()
                found = sensor.read()
                with self._news:
                    self._readings.append(SensorReading(found.value, begun_s, found.time_s))
                    self._problem = ""
                    self._news.notify_all()
                self._ending.wait(PERIOD_S)
        finally:
            sensor.close()

    def _unwanted(self) -> bool:
        idle = not self._waiting and time.monotonic() - self._asked_s > IDLE_S
        return self._ending.is_set() or idle


class LiveStage:
    """The three sensors of one stage with what their readings mean."""

    def __init__(self, sensors: tuple[tuple[SensorSetting, LiveSensor], ...]) -> None:
        self.sensors = sensors


class LiveStages:
    """Every sensor that somebody has looked at; calibrations of one stage share its lines."""

    def __init__(self) -> None:
        self._sensors: dict[tuple[str, str, str], LiveSensor] = {}
        self._taking: set[int] = set()
        self._lock = threading.Lock()

    def of(self, stage: StageSettings) -> LiveStage:
        """Return the live stage of these settings."""
        return LiveStage(tuple((setting, self._on(setting)) for setting in sensor_settings(stage)))

    @contextmanager
    def taking(self, number: int) -> Iterator[None]:
        """Take one touch of a base calibration at a time; raises `Conflict` for a second one."""
        with self._lock:
            if number in self._taking:
                raise Conflict("A touch is being taken at this moment; wait for it.")
            self._taking.add(number)
        try:
            yield
        finally:
            with self._lock:
                self._taking.discard(number)

    def close(self) -> None:
        """Let go of every line."""
        with self._lock:
            for sensor in self._sensors.values():
                sensor.close()

    def _on(self, setting: SensorSetting) -> LiveSensor:
        # The name too: to the mock driver the world's address is that of all three.
        key = (setting.name, setting.driver, setting.address)
        with self._lock:
            if key not in self._sensors:
                self._sensors[key] = LiveSensor(*key)
            return self._sensors[key]


def spread_of(values: list[float]) -> float:
    """Standard deviation of one reading; zero for fewer than two."""
    return statistics.stdev(values) if len(values) > 1 else 0.0
