"""The program in the emulated Modbus controller: commands once each, and a watchdog of its own.

It follows a command when the register `command` is written with another sequence number, moves the
world's robot, and stops it when the heartbeat has stood still for 0.2 s of real time, whoever holds
the connection. Nothing is known here of frames and sockets.
"""

from __future__ import annotations

import asyncio
import time
from typing import Any

from drivers.emulators.modbus_layout import Layout
from drivers.emulators.world_link import WorldLink

CHECK_WORD = 0x01020304
MOVE, STOP = 1, 2
UNSAFE, OUTSIDE_LIMITS, WRONG_CHECK, WATCHDOG, CUT_SHORT, ALREADY_MOVING = 1, 2, 3, 4, 5, 6
REFUSALS = {"unsafe": UNSAFE, "limits": OUTSIDE_LIMITS, "moving": ALREADY_MOVING}
"""Error codes for the world's words; any other word counts as outside the limits."""
WATCHDOG_S = 0.2
CYCLE_S = 0.01
WATCHDOG_DECELERATION = 10.0
"""[rad/s2]"""
NEAR = 1e-6


class Controller:
    """Registers on one side, the world's robot on the other."""

    def __init__(self, world: WorldLink, layout: Layout, prismatic: list[bool]) -> None:
        self._world = world
        self._layout = layout
        self._steps = [layout.slide if slides else layout.turn for slides in prismatic]
        self._orders: dict[int, int] = dict.fromkeys(self._order_places(), 0)
        self._accepted = self._done = self._error = 0
        self._busy = False
        self._target: list[float] = []
        self._beat_s = 0.0
        self._shown: dict[int, int] = {}
        self.frozen = False

    async def read(self, function: int, address: int, count: int) -> list[int] | None:
        """Return registers; those that lie between the values read 0."""
        if function != self._layout.status_function:
            return None
        if not self.frozen or not self._shown:
            self._shown = await self._status()
        wanted = range(address, address + count)
        if wanted.start < min(self._shown) or wanted.stop > max(self._shown) + 1:
            return None
        return [self._shown.get(place, 0) for place in wanted]

    async def write(self, address: int, values: list[int]) -> bool:
        """Take registers; act where the heartbeat or a command is among them."""
        written = dict(enumerate(values, start=address))
        places = range(min(self._orders), max(self._orders) + 1)
        if not (written.keys() <= set(places) or written.keys() == {self._layout.heartbeat}):
            return False
        if written.get(self._layout.heartbeat, 0) != self._orders[self._layout.heartbeat]:
            self._beat_s = time.monotonic()
        self._orders.update(written)
        if self._layout.orders["command"][0] in written:
            await self._follow()
        return True

    async def watch(self) -> None:
        """Look after a motion for ever."""
        while True:
            await asyncio.sleep(CYCLE_S)
            if self._busy:
                silent_s = time.monotonic() - self._beat_s
                if silent_s > WATCHDOG_S and self._error != WATCHDOG:
                    self._error = WATCHDOG
                    await self._world.ask("stop", acceleration=WATCHDOG_DECELERATION)
                await self._look()

    async def _follow(self) -> None:
        sequence = self._order("sequence")
        if sequence == self._accepted:
            return
        self._accepted, self._error = sequence, 0
        if self._orders_words("check") != self._layout.words(CHECK_WORD, 2):
            self._error, self._done = WRONG_CHECK, sequence
        elif self._order("command") == MOVE:
            await self._move(sequence)
        elif self._order("command") == STOP:
            await self._world.ask("stop", acceleration=self._rate("acceleration"))
            self._busy, self._target = True, []
            self._beat_s = time.monotonic()
        else:
            self._done = sequence

    async def _move(self, sequence: int) -> None:
        first = self._layout.order_joints
        self._target = [
            self._layout.signed([self._orders[place], self._orders[place + 1]]) * step
            for place, step in zip(range(first, first + 99, 2), self._steps, strict=False)
        ]
        self._beat_s = time.monotonic()
        reply = await self._world.ask(
            "move",
            joints=self._target,
            speed=self._rate("speed"),
            acceleration=self._rate("acceleration"),
            stop_on_disconnect=True,
        )
        self._busy = reply["ok"]
        if not self._busy:
            self._error = REFUSALS.get(reply["error"], OUTSIDE_LIMITS)
            self._done = sequence

    async def _look(self) -> dict[str, Any]:
        robot = await self._world.ask("robot")
        if self._busy and not robot["moving"]:
            self._busy, self._done = False, self._accepted
            pairs = zip(self._target, robot["joints"], strict=False)
            if not self._error and any(abs(goal - q) > NEAR for goal, q in pairs):
                self._error = CUT_SHORT
        return robot

    async def _status(self) -> dict[int, int]:
        robot = await self._look()
        values = {
            "check": CHECK_WORD,
            "n_joints": len(self._steps),
            "counter": int(time.monotonic() * 200),
            "clock": int(robot["time_s"] * 1e3),
            "accepted": self._accepted,
            "done": self._done,
            "busy": int(self._busy),
            "error": self._error,
            "safety": self._layout.safety[robot["safety"]],
        }
        places: dict[int, int] = {}
        for name, (address, count) in self._layout.status.items():
            places.update(enumerate(self._layout.words(values[name], count), start=address))
        for number, (q, step) in enumerate(zip(robot["joints"], self._steps, strict=True)):
            address = self._layout.status_joints + 2 * number
            places.update(enumerate(self._layout.words(round(q / step), 2), start=address))
        return places

    def _order_places(self) -> list[int]:
        places = [self._layout.heartbeat]
        for address, count in self._layout.orders.values():
            places.extend(range(address, address + count))
        first = self._layout.order_joints
        places.extend(range(first, first + 2 * len(self._steps)))
        return places

    def _orders_words(self, name: str) -> list[int]:
        address, count = self._layout.orders[name]
        return [self._orders[place] for place in range(address, address + count)]

    def _order(self, name: str) -> int:
        return self._orders_words(name)[0]

    def _rate(self, name: str) -> float:
        return self._layout.signed(self._orders_words(name)) * self._layout.turn
