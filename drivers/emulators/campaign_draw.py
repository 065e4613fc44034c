"""What a seed decides about a campaign: where the arm stands, when, how warm, with what payload."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivers.emulators.robot_file import NominalRobot
from drivers.emulators.stance import Circumstances
from drivers.emulators.true_arm import Vector

FULL_SPEED = 1.0
"""Of the leading joint [rad/s]."""
WIDEST = math.pi
"""Joints with more room than this on either side of zero use this much [rad]."""
VISIT_S = 45.0
"""From one row to the next, on average [s]."""
SETTLE_S = 1.0
PAYLOADS_KG = (0.0, 2.0, 4.0)
PAYLOAD_BLOCKS = 6
COLD_DEGC = 20.0
RISE_K = 15.0
APPROACH = 0.2
"""From how far the arm comes where a direction is asked for [rad], [m]."""


@dataclass(frozen=True)
class Size:
    """How much is measured."""

    poses: int = 120
    repeats: int = 18
    """Rows that visit a pose again."""
    check: int = 40
    """Rows of `split: check`, which choose nothing."""
    joint_range: float = 1.0
    """Share of every joint's room that is used."""

    @property
    def rows(self) -> int:
        """All rows."""
        return self.poses + self.repeats + self.check


@dataclass(frozen=True)
class Campaign:
    """Rows in the order in which they are measured; SI units."""

    q: Vector
    """Joint readings, (row, joint)."""
    came_from: Vector
    """Joints at which the last move began, (row, joint)."""
    pose: NDArray[np.int_]
    repeat: NDArray[np.int_]
    check: NDArray[np.bool_]
    time_s: Vector
    temperature_degc: Vector
    payload_kg: Vector
    speed: Vector
    """As a fraction of full speed."""
    settle_s: Vector

    @property
    def approach(self) -> Vector:
        """Direction of the last move, joint by joint."""
        return np.sign(self.q - self.came_from)

    def circumstances(self) -> Circumstances:
        """Everything that effects may depend on."""
        n = len(self.q)
        return Circumstances(
            time_s=self.time_s,
            temperature_degc=self.temperature_degc,
            payload_kg=self.payload_kg,
            readings=np.arange(n, dtype=float),
            last_motion=self.approach,
            last_move=self.q - self.came_from,
            speed=self.speed * FULL_SPEED,
            settled_s=self.settle_s,
            stops=self.q,
            stop=np.arange(n),
        )


def draw_campaign(robot: NominalRobot, size: Size, draw: np.random.Generator) -> Campaign:
    """Draw a campaign of random poses in random order."""
    q = draw_joints(robot, size, draw)
    visited = np.arange(size.poses + size.check)
    again = draw.choice(size.poses, max(size.repeats // 2, 1), replace=False)
    visited = np.concatenate([visited, np.resize(again, size.repeats)])
    order = draw.permutation(len(visited))
    pose = visited[order]
    time_s = np.cumsum(draw.uniform(0.9, 1.1, size.rows)) * VISIT_S
    came_from = np.concatenate([np.zeros((1, q.shape[1])), q[pose[:-1]]])
    return Campaign(
        q=q[pose],
        came_from=came_from,
        pose=pose,
        repeat=_visits_before(pose),
        check=pose >= size.poses,
        time_s=time_s,
        temperature_degc=_temperature(time_s, draw),
        payload_kg=_payloads(size.rows, draw),
        speed=draw.choice([0.3, 0.6, 1.0], size.rows),
        settle_s=np.full(size.rows, SETTLE_S),
    )


def draw_joints(robot: NominalRobot, size: Size, draw: np.random.Generator) -> Vector:
    """Draw joints evenly over a share of their room, somewhere within it."""
    lows, highs = [], []
    for (low, high), slides in zip(robot.limits, robot.table.prismatic, strict=True):
        low, high = (low, high) if slides else (max(low, -WIDEST), min(high, WIDEST))
        spare = (high - low) * (1.0 - size.joint_range)
        start = low + spare * draw.random()
        lows.append(start)
        highs.append(start + (high - low) - spare)
    return draw.uniform(lows, highs, (size.poses + size.check, len(lows)))


def _visits_before(pose: NDArray[np.int_]) -> NDArray[np.int_]:
    return np.array([int(np.sum(pose[:k] == number)) for k, number in enumerate(pose)])


def _temperature(time_s: Vector, draw: np.random.Generator) -> Vector:
    """Rise towards 15 K above the cold arm; mostly cool down again in the last part."""
    span = time_s[-1]
    tau = draw.uniform(0.15, 0.35) * span
    rise = RISE_K * -np.expm1(-time_s / tau)
    if draw.random() < 0.7:
        turn = draw.uniform(0.5, 0.75) * span
        top = RISE_K * -np.expm1(-turn / tau)
        rise = np.where(time_s < turn, rise, top * np.exp(-(time_s - turn) / tau))
    return np.asarray(COLD_DEGC + rise)


def _payloads(rows: int, draw: np.random.Generator) -> Vector:
    """Draw blocks of rows with one payload each; every payload in as many blocks."""
    blocks = draw.permutation(np.resize(PAYLOADS_KG, PAYLOAD_BLOCKS))
    return blocks[np.arange(rows) * PAYLOAD_BLOCKS // rows]


def extended(
    campaign: Campaign, q: Vector, approach: Vector | None, payload_kg: Vector | None
) -> Campaign:
    """Go on with more poses, where the campaign has ended.

    Parameters
    ----------
    q
        Joints to stop at, (row, joint).
    approach
        Directions from which to come, -1, 0 or 1; 0 or None comes straight from the last pose.
    payload_kg
        None keeps the last payload.
    """
    n, last = len(q), -1
    straight = np.concatenate([campaign.q[last:], q[:-1]])
    asked = np.zeros_like(q) if approach is None else approach
    came_from = np.where(asked == 0.0, straight, q - asked * APPROACH)
    time_s = campaign.time_s[last] + VISIT_S * np.arange(1, n + 1)
    payload = np.full(n, campaign.payload_kg[last]) if payload_kg is None else payload_kg
    first_pose = int(campaign.pose.max()) + 1
    return replace(
        campaign,
        q=np.concatenate([campaign.q, q]),
        came_from=np.concatenate([campaign.came_from, came_from]),
        pose=np.concatenate([campaign.pose, first_pose + np.arange(n)]),
        repeat=np.concatenate([campaign.repeat, np.zeros(n, dtype=int)]),
        check=np.concatenate([campaign.check, np.zeros(n, dtype=bool)]),
        time_s=np.concatenate([campaign.time_s, time_s]),
        temperature_degc=np.concatenate([
            campaign.temperature_degc,
            np.full(n, campaign.temperature_degc[last]),
        ]),
        payload_kg=np.concatenate([campaign.payload_kg, payload]),
        speed=np.concatenate([campaign.speed, np.full(n, 1.0)]),
        settle_s=np.concatenate([campaign.settle_s, np.full(n, SETTLE_S)]),
    )
