"""One touch of the sensing stage: a robot's joints and three sensors, read while all stands still.

Nothing is driven here. A person jogs or leads the robot until its needle sits in a cup, and then
asks for the touch; what moves, is old or wavers is refused with what to do about it.
"""

import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass
from itertools import pairwise

from drivers.errors import DriverError
from drivers.interfaces import RobotState
from drivers.registry import open_robot
from service.base_calibrations.live import (
    STEADY,
    WINDOW,
    LiveSensor,
    LiveStage,
    SensorSetting,
    spread_of,
)
from service.procedures.visit import STILL_WITHIN

LOOKS = 3
"""Looks at the robot's joints, before the sensors are read and again after."""
TAKE_S = 35.0
"""Longest time for five readings of the slowest sensor [s].

A rangefinder that does not answer is asked three times in 28 s before it is said what is wrong.
"""


class TouchRefused(Exception):
    """The touch was not taken; the message says why and what to do."""


@dataclass(frozen=True)
class TouchingArm:
    """The robot whose needle is in a cup."""

    role: str
    driver: str
    address: str
    n_joints: int


@dataclass(frozen=True)
class TakenTouch:
    """What was read. SI units."""

    joints: tuple[float, ...]
    readings: tuple[float, ...]
    """Slide, rod angle, rod length."""
    spreads: tuple[float, ...]
    """Standard deviation of one reading of each."""
    shots: int


def take_touch(arm: TouchingArm, stage: LiveStage) -> TakenTouch:
    """Read robot and sensors.

    Raises
    ------
    TouchRefused
        If a device does not answer, or anything moves or wavers.
    """
    try:
        with closing(open_robot(arm.driver, arm.address, arm.n_joints)) as robot:
            robot.connect()
            before = [robot.state() for _ in range(LOOKS)]
            _require_rest(arm, before)
            found = _read_sensors(stage)
            states = before + [robot.state() for _ in range(LOOKS)]
    except DriverError as error:
        raise TouchRefused(f"The touch was not taken: the {arm.role} is not read: {error}") from (
            error
        )
    _require_rest(arm, states)
    return TakenTouch(
        joints=_mean([state.joints for state in states]),
        readings=tuple(sum(values) / len(values) for values in found),
        spreads=tuple(spread_of(values) for values in found),
        shots=WINDOW,
    )


def _read_sensors(stage: LiveStage) -> list[list[float]]:
    begun_s = time.monotonic()
    for _, sensor in stage.sensors:
        # Ask all before waiting for one: their threads read at the same time.
        sensor.look()
    return [_steady_values(setting, sensor, begun_s) for setting, sensor in stage.sensors]


def _steady_values(setting: SensorSetting, sensor: LiveSensor, begun_s: float) -> list[float]:
    name = setting.name
    readings = sensor.await_readings(WINDOW, begun_s, begun_s + TAKE_S)
    if len(readings) < WINDOW:
        problem = sensor.look()[1]
        because = f": {problem}" if problem else "; check its power and cable"
        raise TouchRefused(
            f"The touch was not taken: sensor '{name}' gave {len(readings)} of {WINDOW} fresh "
            f"readings within {TAKE_S:g} s{because}"
        )
    if any(b.clock_s <= a.clock_s for a, b in pairwise(readings)):
        raise TouchRefused(
            f"The touch was not taken: the clock of sensor '{name}' stands still, so its readings "
            "are old; restart the sensor."
        )
    values = [setting.on_stage(reading.value) for reading in readings]
    allowed = STEADY * setting.sigma
    if spread_of(values) > allowed:
        spread, most = (v / setting.scale for v in (spread_of(values), allowed))
        raise TouchRefused(
            f"The touch was not taken: sensor '{name}' wavers by {spread:.3g} {setting.unit} "
            f"(standard deviation of {WINDOW} readings; at rest at most {most:.3g}); clamp the "
            "stage, keep hands off it, and take the touch again."
        )
    return values


def _require_rest(arm: TouchingArm, states: Sequence[RobotState]) -> None:
    if any(state.moving for state in states):
        raise TouchRefused(
            f"The touch was not taken: the {arm.role} moves; let it stand, then take it again."
        )
    columns = zip(*(state.joints for state in states), strict=True)
    for joint, readings in enumerate(columns, start=1):
        change = max(readings) - min(readings)
        if change > STILL_WITHIN:
            raise TouchRefused(
                f"The touch was not taken: joint {joint} of the {arm.role} moved by {change:.5f} "
                "(rad or m) meanwhile; let the robot stand, then take the touch again."
            )


def _mean(rows: Sequence[tuple[float, ...]]) -> tuple[float, ...]:
    return tuple(sum(column) / len(rows) for column in zip(*rows, strict=True))
