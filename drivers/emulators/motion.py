"""Joint motion with a finite speed: trapezoidal profiles, all joints together.

The path parameter s goes from 0 to 1: it accelerates for `ramp_s`, runs, and decelerates for
`ramp_s`. A stop is the second half of such a profile, whose start lies behind the robot and in
the past; so one formula serves both.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Segment:
    """One motion along a straight line in joint space."""

    start: tuple[float, ...]
    """[rad], [m] for a prismatic joint."""
    target: tuple[float, ...]
    start_s: float
    """World time at which s leaves 0 [s]."""
    ramp_s: float
    duration_s: float

    def progress(self, time_s: float) -> float:
        """Path parameter s at a world time, 0 before the start and 1 after the end."""
        t = time_s - self.start_s
        if t <= 0.0:
            return 0.0 if self.duration_s > 0.0 else 1.0
        if t >= self.duration_s:
            return 1.0
        plateau = 1.0 / (self.duration_s - self.ramp_s)
        if t < self.ramp_s:
            return 0.5 * plateau * t * t / self.ramp_s
        left = self.duration_s - t
        if left < self.ramp_s:
            return 1.0 - 0.5 * plateau * left * left / self.ramp_s
        return plateau * (t - 0.5 * self.ramp_s)

    def rate(self, time_s: float) -> float:
        """Time derivative of s [1/s]."""
        t = time_s - self.start_s
        left = self.duration_s - t
        if t <= 0.0 or left <= 0.0:
            return 0.0
        plateau = 1.0 / (self.duration_s - self.ramp_s)
        return plateau * min(1.0, t / self.ramp_s, left / self.ramp_s)

    def joints(self, time_s: float) -> tuple[float, ...]:
        """Joint positions at a world time, exactly the target after the end."""
        s = self.progress(time_s)
        if s >= 1.0:
            return self.target
        return tuple(a + (b - a) * s for a, b in zip(self.start, self.target, strict=True))

    def moving(self, time_s: float) -> bool:
        """Whether the motion has not ended yet."""
        return time_s < self.start_s + self.duration_s


def at_rest(joints: tuple[float, ...], time_s: float) -> Segment:
    """Return a motion that has already ended."""
    return Segment(joints, joints, time_s, 0.0, 0.0)


def leading_distance(segment: Segment) -> float:
    """Distance of the joint that goes farthest [rad], [m]."""
    return max(abs(b - a) for a, b in zip(segment.start, segment.target, strict=True))


def move(
    start: tuple[float, ...],
    target: tuple[float, ...],
    time_s: float,
    speed: float,
    acceleration: float,
) -> Segment:
    """Plan a motion from rest to rest, the leading joint at `speed` and `acceleration` [rad, s]."""
    distance = leading_distance(Segment(start, target, time_s, 0.0, 0.0))
    if distance == 0.0:
        return at_rest(target, time_s)
    if distance * acceleration >= speed * speed:
        ramp = speed / acceleration
        return Segment(start, target, time_s, ramp, distance / speed + ramp)
    ramp = math.sqrt(distance / acceleration)
    return Segment(start, target, time_s, ramp, 2.0 * ramp)


def stop(segment: Segment, time_s: float, deceleration: float) -> Segment:
    """Bring a motion to rest along its path, the leading joint at `deceleration` [rad/s2].

    A stop weaker than the braking that the motion would do anyway ends at the motion's target.
    """
    here = segment.joints(time_s)
    rate = segment.rate(time_s)
    if rate == 0.0:
        return at_rest(here, time_s)
    s_now = segment.progress(time_s)
    braking = rate * rate * leading_distance(segment) / (2.0 * deceleration)
    s_end = min(s_now + braking, 1.0)
    ramp = 2.0 * (s_end - s_now) / rate
    end = tuple(a + (b - a) * s_end for a, b in zip(segment.start, segment.target, strict=True))
    behind = tuple(2.0 * h - e for h, e in zip(here, end, strict=True))
    return Segment(behind, end, time_s - ramp, ramp, 2.0 * ramp)
