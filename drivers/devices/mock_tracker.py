"""Tracker of the emulated world, without any tracker's wire: full poses over one plain socket."""

from __future__ import annotations

import math

from drivers.errors import BadReply, Refused
from drivers.interfaces import FixedNest, TrackerReading
from drivers.transport import JsonReply, LineSocket, ask_json, read_again

REPLY_TIMEOUT_S = 2.0

ADVICE = {
    "no_target": "clear the line of sight and measure again",
    "no_nest": "name a nest that the world has",
}


class MockTracker:
    """A tracker that sees position and orientation, at ``host:port`` of an emulated world."""

    def __init__(self, address: str) -> None:
        self._device = f"tracker mock at {address}"
        self._line = LineSocket(self._device, address, REPLY_TIMEOUT_S)

    def connect(self) -> None:
        """Open the socket and see that a world answers."""
        self._line.open()
        read_again(lambda: self._ask("hello"))

    def measure(self) -> TrackerReading:
        """Read the target once: one shot with the noise of the world's instrument."""
        return read_again(lambda: self._read({}))

    def measure_fixed(self, nest: FixedNest) -> TrackerReading:
        """Read the target in a fixed nest of the world, by its name."""
        return read_again(lambda: self._read({"target": nest.name}))

    def _read(self, what: dict[str, str]) -> TrackerReading:
        reply = self._ask("measure", what)
        position, turn = reply.numbers("position"), reply.numbers("orientation")
        if len(position) != 3 or len(turn) != 4 or abs(math.hypot(*turn) - 1.0) > 1e-6:
            raise BadReply(self._device, "measure", "position or quaternion malformed", reply.raw)
        x, y, z = position
        qw, qx, qy, qz = turn
        return TrackerReading((x, y, z), (qw, qx, qy, qz), 0.0, 1, reply.number("time_s"))

    def close(self) -> None:
        """Close the socket."""
        self._line.close()

    def _ask(self, operation: str, what: dict[str, str] | None = None) -> JsonReply:
        request = {"op": operation, **(what or {})}
        reply = ask_json(self._line, self._device, operation, request)
        if reply.yes("ok"):
            return reply
        advice = ADVICE.get(reply.word("error"), "check what was asked")
        raise Refused(self._device, operation, f"{reply.word('message')} To do: {advice}.")
