"""One visit to one pose: drive there, let it settle, read joints and tracker."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from drivers.interfaces import JointMotion, Robot, RobotState, Tracker, TrackerReading
from service.cells.models import Limits
from service.jobs.watch import Watch
from service.procedures.job import Held

JOINT_READINGS_BEFORE = 3
JOINT_READINGS_AFTER = 2
ARRIVED_WITHIN = 2e-3
"""Largest distance between commanded and read joints on arrival [rad or m]."""
STILL_WITHIN = 2e-4
"""Largest change of a joint reading while the tracker measures [rad or m]."""
MOVED_FROM = 1e-4
"""A joint that moves less has no new direction of approach [rad or m]."""
_POLL_S = 0.01
_DEADLINE_FACTOR, _DEADLINE_MARGIN_S = 3.0, 10.0
_SETTLE_MARGIN_S = 30.0


@dataclass(frozen=True)
class Pace:
    """How the robot moves in this campaign. SI units."""

    speed: float
    acceleration: float
    full_speed: float
    settle_s: float


@dataclass(frozen=True)
class Seconds:
    """Where the time of one visit went, on the host's clock [s]."""

    motion: float
    settling: float
    measuring: float


@dataclass(frozen=True)
class Sight:
    """What was read at a pose."""

    joints: tuple[float, ...]
    settle_s: float
    robot_time_s: float
    reading: TrackerReading
    seconds: Seconds


def pace_of(limits: Limits, settle_s: float) -> Pace:
    """Return the pace that a cell's limits allow."""
    return Pace(
        speed=math.radians(limits.speed_deg_s),
        acceleration=math.radians(limits.acceleration_deg_s2),
        full_speed=math.radians(limits.full_speed_deg_s),
        settle_s=settle_s,
    )


def approach_signs(
    start: Sequence[float], target: Sequence[float], before: Sequence[int]
) -> list[int]:
    """Direction in which each joint moves last; as `before` where it does not move."""
    return [
        sign if abs(b - a) < MOVED_FROM else int(math.copysign(1, b - a))
        for a, b, sign in zip(start, target, before, strict=True)
    ]


def visit(
    robot: Robot, tracker: Tracker, commanded: Sequence[float], pace: Pace, watch: Watch
) -> Sight:
    """Drive to a pose and read it.

    Raises
    ------
    DriverError
        When a device does not do its part.
    Held
        When the robot is not where it was sent, or moves while it is measured.
    Stopped
        When the job is no longer wanted.
    """
    clock = [time.perf_counter()]
    start = robot.state().joints
    robot.move(_motion(start, commanded, pace), watch.may_continue)
    clock.append(time.perf_counter())
    still_since, state = settle(robot, pace.settle_s, watch)
    _require_arrival(state, commanded)
    clock.append(time.perf_counter())
    before = [robot.state() for _ in range(JOINT_READINGS_BEFORE)]
    reading = tracker.measure()
    after = [robot.state() for _ in range(JOINT_READINGS_AFTER)]
    clock.append(time.perf_counter())
    _require_stillness(before + after)
    return Sight(
        joints=_mean([look.joints for look in before + after]),
        settle_s=before[0].time_s - still_since,
        robot_time_s=before[-1].time_s,
        reading=reading,
        seconds=Seconds(*(b - a for a, b in pairwise(clock))),
    )


def settle(robot: Robot, settle_s: float, watch: Watch) -> tuple[float, RobotState]:
    """Wait until the robot has stood still for `settle_s` on its own clock; since when it stood."""
    deadline = time.monotonic() + settle_s + _SETTLE_MARGIN_S
    still_since: float | None = None
    while True:
        state = robot.state()
        if state.moving:
            still_since = None
        elif still_since is None:
            still_since = state.time_s
        if still_since is not None and state.time_s - still_since >= settle_s:
            return still_since, state
        if time.monotonic() > deadline:
            raise Held(
                f"The robot did not come to rest within {settle_s + _SETTLE_MARGIN_S:g} s; "
                "look what moves it, then resume."
            )
        watch.wait(_POLL_S)


def _motion(start: Sequence[float], target: Sequence[float], pace: Pace) -> JointMotion:
    distance = max(abs(b - a) for a, b in zip(start, target, strict=True))
    expected_s = distance / pace.speed + pace.speed / pace.acceleration
    return JointMotion(
        joints=tuple(target),
        speed=pace.speed,
        acceleration=pace.acceleration,
        deadline_s=_DEADLINE_FACTOR * expected_s + _DEADLINE_MARGIN_S,
    )


def _require_arrival(state: RobotState, commanded: Sequence[float]) -> None:
    off = [abs(a - b) for a, b in zip(state.joints, commanded, strict=True)]
    worst = max(range(len(off)), key=off.__getitem__)
    if off[worst] > ARRIVED_WITHIN:
        raise Held(
            f"The robot stopped before its target: joint {worst + 1} is {off[worst]:.4f} "
            "(rad or m) away; look what else commands the robot, then resume."
        )


def _require_stillness(states: Sequence[RobotState]) -> None:
    for joint, readings in enumerate(zip(*(state.joints for state in states), strict=True)):
        change = max(readings) - min(readings)
        if change > STILL_WITHIN:
            raise Held(
                f"The robot moved while it was measured: joint {joint + 1} by {change:.5f} "
                "(rad or m); look what else commands the robot, then resume."
            )


def _mean(rows: Sequence[tuple[float, ...]]) -> tuple[float, ...]:
    return tuple(sum(column) / len(rows) for column in zip(*rows, strict=True))
