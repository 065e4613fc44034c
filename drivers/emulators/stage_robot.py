"""One robot at the stage: led by hand until its needle sits in a cup.

The joints are searched on the true geometry that the robot's own world tells; what effects add to
it is taken off by aiming again until the world itself says that the needle is there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from drivers.emulators.records import WorldError
from drivers.emulators.rigid import Frame, Matrix
from drivers.emulators.true_arm import LinkTable, Vector, link_frames
from drivers.emulators.world_link import WorldLink

NEAR = 1e-7
"""How near the needle comes to the middle of the cup [m]"""
STEPS, TRIES, AIMS = 80, 40, 5
DAMPING = 0.03
NUDGE = 1e-6
"""Step of a difference quotient [rad or m]"""
LONGEST = 0.4
"""Longest joint step [rad or m]"""
WIDEST = 3.1
"""Starts are drawn from joints within this of zero [rad or m]"""


class StageRobot:
    """A robot's world, seen from the stage."""

    def __init__(self, name: str, link: WorldLink, limits: Vector, seed: int) -> None:
        self.name = name
        self._link = link
        self._limits = limits
        self._rng = np.random.default_rng(seed)

    @classmethod
    async def meet(cls, name: str, address: str, seed: int) -> StageRobot:
        """Connect to the world at ``host:port``."""
        link = await WorldLink.open(address)
        hello = await link.ask("hello")
        return cls(name, link, np.array(hello["limits"], dtype=float), seed)

    async def needle(self) -> Vector:
        """Where the needle truly is, in the robot's base [m]."""
        truth = await self._link.ask("truth")
        return _in_base(truth)

    async def lead(self, place: Vector) -> list[float]:
        """Lead the robot by hand until the needle is at `place` in its base; return its joints."""
        truth = await self._link.ask("truth")
        arm = _Arm(truth, self._limits)
        start = np.array(truth["joints"])
        aim = place
        for _ in range(AIMS):
            q = self._search(arm, aim, start)
            await self._guide(q)
            miss = place - await self.needle()
            if float(np.linalg.norm(miss)) < NEAR:
                return [float(v) for v in q]
            aim, start = aim + miss, q
        raise WorldError("reach", f"The {self.name}'s needle does not come to rest in the cup.")

    async def _guide(self, q: Vector) -> None:
        reply = await self._link.ask("guide", joints=[float(v) for v in q])
        if not reply["ok"]:
            raise WorldError(reply["error"], reply["message"])

    def _search(self, arm: _Arm, place: Vector, start: Vector) -> Vector:
        low = np.maximum(self._limits[:, 0], -WIDEST)
        high = np.minimum(self._limits[:, 1], WIDEST)
        for _ in range(TRIES):
            q = arm.approach(place, start)
            if float(np.linalg.norm(arm.tips(q[None])[0] - place)) < NEAR / 10:
                return q
            start = self._rng.uniform(low, high)
        x, y, z = place * 1e3
        raise WorldError(
            "reach", f"The {self.name} does not reach ({x:.0f}, {y:.0f}, {z:.0f}) mm in its base."
        )


class _Arm:
    """True links and needle of a robot whose world has told them."""

    def __init__(self, truth: dict[str, Any], limits: Vector) -> None:
        columns = {name: np.array(truth[name]) for name in ("theta", "d", "a", "alpha", "beta")}
        self._table = LinkTable(**columns, prismatic=tuple(truth["prismatic"]))
        self._needle = Frame(**truth["tool"]).matrix()
        self._limits = limits

    def tips(self, q: Vector) -> Vector:
        """Needle tips of rows of joints, in the base [m]."""
        return np.asarray((link_frames(self._table, q)[-1] @ self._needle)[..., :3, 3])

    def approach(self, place: Vector, start: Vector) -> Vector:
        """Damped Newton steps towards a place; ends where it is reached or no step helps."""
        q = np.clip(start, self._limits[:, 0], self._limits[:, 1])
        n = len(q)
        for _ in range(STEPS):
            rows = self.tips(q + np.vstack([np.zeros(n), NUDGE * np.eye(n)]))
            away = place - rows[0]
            if float(np.linalg.norm(away)) < NEAR / 100:
                break
            J = (rows[1:] - rows[0]).T / NUDGE
            damping = DAMPING**2 * min(1.0, float(np.linalg.norm(away)))
            step = J.T @ np.linalg.solve(J @ J.T + (damping + 1e-12) * np.eye(3), away)
            q = np.clip(
                q + np.clip(step, -LONGEST, LONGEST), self._limits[:, 0], self._limits[:, 1]
            )
        return np.asarray(q)


def _in_base(truth: dict[str, Any]) -> Matrix:
    """Needle in the robot's base, out of a world that counts in its tracker's frame."""
    base = Frame(**truth["base"]).matrix()
    return np.asarray(base[:3, :3].T @ (np.array(truth["position"]) - base[:3, 3]))
