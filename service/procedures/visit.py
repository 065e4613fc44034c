"""One visit to one pose: drive there, let it settle, read joints and tracker, believe it or not."""

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from drivers.interfaces import JointMotion, Robot, RobotState, Tracker, TrackerReading
from service.cells.models import Limits, TrackerSettings
from service.jobs.watch import Watch

JOINT_READINGS_BEFORE = 3
JOINT_READINGS_AFTER = 2
LOOKS = 3
"""How often a pose is measured in place before its reading counts as not to be had."""
ARRIVED_WITHIN = 2e-3
"""Largest distance between commanded and read joints on arrival [rad or m]."""
STILL_WITHIN = 2e-4
"""Largest change of a joint reading while the robot stands and the tracker measures [rad or m]."""
MOVED_FROM = 1e-4
"""A joint that moves less has no new direction of approach [rad or m]."""
SPREAD_SIGMAS = 5.0
"""So many standard uncertainties of the instrument may the shots of one reading scatter."""
_POLL_S = 0.01
_DEADLINE_FACTOR, _DEADLINE_MARGIN_S = 3.0, 10.0
_SETTLE_MARGIN_S = 30.0


class PoseNotTrue(Exception):
    """What was read is not the pose that was wanted; the message says why."""


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


@dataclass(frozen=True)
class Visitor:
    """What a visit needs of its campaign."""

    robot: Robot
    tracker: Tracker
    tracker_settings: TrackerSettings
    pace: Pace
    watch: Watch
    seen: Callable[[tuple[float, ...]], None]
    """Told the joints of the moving robot."""


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
    visitor: Visitor,
    start: tuple[float, ...],
    stops: Sequence[tuple[float, ...]],
    permit: Callable[[], RobotState],
    meanwhile: Callable[[], None],
) -> Sight:
    """Drive over the stops to the last one, the pose, and read it.

    Parameters
    ----------
    start
        Where the robot stands; the first motion is permitted already.
    permit
        Asked before every further motion, gives where the robot stands; raises when it must not
        move.
    meanwhile
        Done once while the robot settles.

    Raises
    ------
    DriverError
        When a device does not do its part.
    PoseNotTrue
        When the robot is not where it was sent, does not stand still, or the reading scatters.
    Stopped
        When the job is no longer wanted.
    """
    motion_s = _drive(visitor, start, stops[0])
    for stop in stops[1:]:
        motion_s += _drive(visitor, permit().joints, stop)
    clock = [time.perf_counter()]
    meanwhile()
    still_since, state = settle(visitor.robot, visitor.pace.settle_s, visitor.watch)
    _require_arrival(state, stops[-1])
    clock.append(time.perf_counter())
    joints, robot_time_s, reading = _look_until_true(visitor)
    clock.append(time.perf_counter())
    return Sight(
        joints=joints,
        settle_s=robot_time_s - still_since,
        robot_time_s=robot_time_s,
        reading=reading,
        seconds=Seconds(motion_s, *(b - a for a, b in pairwise(clock))),
    )


def _drive(visitor: Visitor, start: tuple[float, ...], stop: tuple[float, ...]) -> float:
    """Make one motion; the time it took [s]."""
    motion = _motion(start, stop, visitor.pace)
    began = time.perf_counter()
    visitor.robot.move(motion, visitor.watch.may_continue, visitor.seen)
    return time.perf_counter() - began


def settle(robot: Robot, settle_s: float, watch: Watch) -> tuple[float, RobotState]:
    """Wait until the joints have stood still for `settle_s` on the robot's clock; since when.

    Raises
    ------
    PoseNotTrue
        When they do not come to rest.
    """
    deadline = time.monotonic() + settle_s + _SETTLE_MARGIN_S
    first: RobotState | None = None
    while True:
        state = robot.state()
        if state.moving:
            first = None
        elif first is None or _moved(first, state) is not None:
            first = state
        if first is not None and state.time_s - first.time_s >= settle_s:
            return first.time_s, state
        if time.monotonic() > deadline:
            raise PoseNotTrue(
                f"the robot did not come to rest within {settle_s + _SETTLE_MARGIN_S:g} s; "
                "look what moves it"
            )
        watch.wait(_POLL_S)


def _look_until_true(visitor: Visitor) -> tuple[tuple[float, ...], float, TrackerReading]:
    """Mean joints, the robot's clock, and the reading that belongs to them."""
    failure = PoseNotTrue("never looked at")
    for _ in range(LOOKS):
        try:
            return _look(visitor)
        except PoseNotTrue as not_true:
            failure = not_true
            visitor.watch.check()
    raise failure


def _look(visitor: Visitor) -> tuple[tuple[float, ...], float, TrackerReading]:
    robot = visitor.robot
    before = [robot.state() for _ in range(JOINT_READINGS_BEFORE)]
    reading = visitor.tracker.measure()
    states = before + [robot.state() for _ in range(JOINT_READINGS_AFTER)]
    for state in states:
        joint = _moved(before[0], state)
        if joint is not None:
            change = abs(state.joints[joint] - before[0].joints[joint])
            raise PoseNotTrue(
                f"the robot moved while it was measured: joint {joint + 1} by {change:.5f} "
                "(rad or m); look what else commands the robot"
            )
    _require_little_spread(reading, visitor.tracker_settings)
    return _mean([state.joints for state in states]), before[-1].time_s, reading


def spread_limit(position: Sequence[float], settings: TrackerSettings) -> float:
    """Largest standard deviation of the shots that a reading at a position may have [m]."""
    if settings.spread_mm is not None:
        return settings.spread_mm * 1e-3
    growing = settings.sigma_ppm * 1e-6 * math.hypot(*position)
    return SPREAD_SIGMAS * math.hypot(settings.sigma_mm * 1e-3, growing)


def _require_little_spread(reading: TrackerReading, settings: TrackerSettings) -> None:
    limit = spread_limit(reading.position, settings)
    if reading.spread > limit:
        raise PoseNotTrue(
            f"the tracker's {reading.shots} shots scatter by {reading.spread * 1e3:.3f} mm, "
            f"allowed are {limit * 1e3:.3f} mm; look for vibration, air and the beam's way, or "
            "set tracker.spread_mm"
        )


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
        raise PoseNotTrue(
            f"the robot stopped before its target: joint {worst + 1} is {off[worst]:.4f} "
            "(rad or m) away; look what else commands the robot"
        )


def _moved(one: RobotState, other: RobotState) -> int | None:
    """Return the joint that stands elsewhere in the other look; None if none does."""
    changes = [abs(a - b) for a, b in zip(one.joints, other.joints, strict=True)]
    worst = max(range(len(changes)), key=changes.__getitem__)
    return worst if changes[worst] > STILL_WITHIN else None


def _mean(rows: Sequence[tuple[float, ...]]) -> tuple[float, ...]:
    return tuple(sum(column) / len(rows) for column in zip(*rows, strict=True))
