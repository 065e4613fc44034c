"""The emulated controller's arm: joints, motion and safety of the emulated world.

Nothing is known here of RTDE or URScript. The world is asked once per controller cycle.
"""

import asyncio
import json
import math
from dataclasses import dataclass
from typing import Any

N_JOINTS = 6
MOTION_ALLOWED = frozenset({"normal", "reduced"})


class WorldRefusedError(Exception):
    """The world declined a request."""


@dataclass(frozen=True)
class ArmState:
    """One look at the world's robot."""

    joints: tuple[float, ...]
    """[rad]"""
    velocity: tuple[float, ...]
    """[rad/s], world time; exactly zero at rest."""
    moving: bool
    safety: str
    time_s: float

    @property
    def may_move(self) -> bool:
        """Whether the safety system allows motion."""
        return self.safety in MOTION_ALLOWED


class Arm:
    """One connection to the world's process."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader = reader
        self._writer = writer
        self._one_at_a_time = asyncio.Lock()
        still = (0.0,) * N_JOINTS
        self.state = ArmState(still, still, moving=False, safety="not_ready", time_s=0.0)

    @classmethod
    async def connect(cls, host: str, port: int) -> "Arm":
        """Open the world's socket and read the robot once.

        Raises
        ------
        WorldRefusedError
            The world's robot does not have the six joints of a UR.
        """
        arm = cls(*await asyncio.open_connection(host, port))
        world = await arm._ask(op="hello")
        if world["n_joints"] != N_JOINTS:
            raise WorldRefusedError(
                f"the world's robot has {world['n_joints']} joints and a UR has {N_JOINTS}: "
                "start the world with a UR's robot.yaml"
            )
        await arm.look()
        return arm

    async def look(self) -> ArmState:
        """Read the world's robot; the velocity is the difference to the look before."""
        reply = await self._ask(op="robot")
        joints = tuple(reply["joints"])
        before, elapsed = self.state, reply["time_s"] - self.state.time_s
        velocity = (0.0,) * N_JOINTS
        if reply["moving"] and elapsed > 0.0:
            pairs = zip(joints, before.joints, strict=True)
            velocity = tuple((now - then) / elapsed for now, then in pairs)
        self.state = ArmState(joints, velocity, reply["moving"], reply["safety"], reply["time_s"])
        return self.state

    async def move(self, joints: tuple[float, ...], speed: float, acceleration: float) -> None:
        """Start a joint motion; speed and acceleration are the leading joint's."""
        if not all(math.isfinite(value) for value in (*joints, speed, acceleration)):
            raise WorldRefusedError(f"moveJ to {joints} is not a motion")
        await self._ask(op="move", joints=joints, speed=speed, acceleration=acceleration)

    async def stop(self, acceleration: float) -> None:
        """Decelerate along the path [rad/s2]."""
        await self._ask(op="stop", acceleration=acceleration)

    async def switch_safety(self, word: str) -> None:
        """Put the world's safety system into another state."""
        await self._ask(op="set", name="safety", value=word)

    async def _ask(self, **request: Any) -> dict[str, Any]:  # noqa: ANN401 - a JSON object
        async with self._one_at_a_time:
            self._writer.write(json.dumps(request).encode() + b"\n")
            line = await self._reader.readline()
        if not line:
            raise ConnectionResetError("the world has closed its socket")
        reply: dict[str, Any] = json.loads(line)
        if not reply["ok"]:
            raise WorldRefusedError(reply["message"])
        return reply
