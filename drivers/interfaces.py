"""What the service expects of a robot, a tracker, a stage sensor, a temperature probe. SI, radians.

Every object is used by one thread at a time. `connect` before anything else; `close` always,
also after an error. Every call has a deadline of its own and raises a `DriverError` past it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, runtime_checkable


class Safety(StrEnum):
    """Safety state of a robot controller, as far as it decides whether a motion may start."""

    normal = "normal"
    reduced = "reduced"
    protective_stop = "protective_stop"
    emergency_stop = "emergency_stop"
    safeguard_stop = "safeguard_stop"
    fault = "fault"
    not_ready = "not_ready"


MAY_MOVE = frozenset({Safety.normal, Safety.reduced})
STOP_DECELERATION = 10.0
"""Of the leading joint when a person or a fault stops the robot [rad/s2]."""


@dataclass(frozen=True)
class RobotState:
    """One consistent look at the controller."""

    joints: tuple[float, ...]
    """Joint readings [rad], [m] for a prismatic joint."""
    moving: bool
    safety: Safety
    advice: str
    """What a person should do where `safety` forbids motion; empty otherwise."""
    time_s: float
    """The controller's own clock [s]."""


@dataclass(frozen=True)
class JointMotion:
    """A joint-space move: all joints start and end together."""

    joints: tuple[float, ...]
    """Target readings [rad], [m] for a prismatic joint."""
    speed: float
    """Speed of the leading joint [rad/s]."""
    acceleration: float
    """Acceleration of the leading joint [rad/s2]."""
    deadline_s: float
    """The robot is stopped and `NoReply` raised when it has not arrived by then [s]."""


def nobody_looks(joints: tuple[float, ...]) -> None:
    """Take the joints of a moving robot, and do nothing with them."""


class Robot(Protocol):
    """A robot arm that can be sent to joint positions and read."""

    def connect(self) -> None:
        """Open the connection and check that the controller takes commands."""
        ...

    def state(self) -> RobotState:
        """Read joints, motion and safety state once."""
        ...

    def move(
        self,
        motion: JointMotion,
        may_continue: Callable[[], bool],
        seen: Callable[[tuple[float, ...]], None] = nobody_looks,
    ) -> None:
        """Drive to the target and return when the controller says it has arrived.

        `may_continue` is asked at least every 50 ms; when it answers False the robot is stopped
        and `Interrupted` raised. `seen` is told the joint readings as often, and must not wait.
        Checks the safety state before it starts. The motion is never started twice by one call.
        Any error leaves the robot stopped or being stopped by the watchdog in the controller.
        """
        ...

    def stop(self) -> None:
        """Stop the robot. Safe to call at any time, in any state."""
        ...

    def close(self) -> None:
        """Stop the robot if it moves and let go of it."""
        ...


@dataclass(frozen=True)
class TrackerReading:
    """Target position in the tracker's frame, the mean of `shots` single measurements."""

    position: tuple[float, float, float]
    """[m]"""
    orientation: tuple[float, float, float, float] | None
    """Unit quaternion w, x, y, z of the target in the tracker's frame; None for 3D trackers."""
    spread: float
    """Largest standard deviation over the shots of one coordinate [m]; 0 for a single shot."""
    shots: int
    time_s: float
    """The tracker's or the host's clock [s]."""


@dataclass(frozen=True)
class FixedNest:
    """A nest with a target that stands fixed beside the robot."""

    name: str
    position: tuple[float, float, float]
    """About where, in the tracker's frame [m]."""


class Tracker(Protocol):
    """An instrument that measures where the target is."""

    def connect(self) -> None:
        """Open the connection and check that the instrument is ready."""
        ...

    def measure(self) -> TrackerReading:
        """Measure the target once (averaging as configured)."""
        ...

    def close(self) -> None:
        """Let go of the instrument."""
        ...


@runtime_checkable
class TurningTracker(Tracker, Protocol):
    """A tracker that can turn to a fixed nest and back to the robot's target by itself."""

    def measure_fixed(self, nest: FixedNest) -> TrackerReading:
        """Measure the target in a fixed nest, then turn back to where it looked before."""
        ...


@dataclass(frozen=True)
class StageReading:
    """One reading of one sensor of the calibration stage."""

    value: float
    """[m] or [rad], as the sensor measures"""
    spread: float
    time_s: float


class StageSensor(Protocol):
    """A rangefinder, encoder or gauge of the calibration stage."""

    def connect(self) -> None:
        """Open the connection and check that the sensor answers."""
        ...

    def read(self) -> StageReading:
        """Read the sensor once."""
        ...

    def close(self) -> None:
        """Let go of the sensor."""
        ...


@dataclass(frozen=True)
class TemperatureReading:
    """One reading of a temperature probe."""

    temperature_degc: float
    time_s: float
    """The host's clock [s]."""


class TemperatureProbe(Protocol):
    """A probe at the robot, the stage or in the air."""

    def connect(self) -> None:
        """Open the connection and check that the probe answers."""
        ...

    def read(self) -> TemperatureReading:
        """Read the probe once."""
        ...

    def close(self) -> None:
        """Let go of the probe."""
        ...
