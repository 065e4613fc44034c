"""Temperature probe of the emulated world, over one plain socket to the world."""

from __future__ import annotations

import time

from drivers.errors import Refused
from drivers.interfaces import TemperatureReading
from drivers.transport import JsonReply, LineSocket, ask_json, read_again

REPLY_TIMEOUT_S = 2.0


class MockTemperature:
    """The probe on the arm, at ``host:port`` of an emulated world."""

    def __init__(self, address: str) -> None:
        self._device = f"temperature probe mock at {address}"
        self._line = LineSocket(self._device, address, REPLY_TIMEOUT_S)

    def connect(self) -> None:
        """Open the socket and see that a world answers."""
        self._line.open()
        self.read()

    def read(self) -> TemperatureReading:
        """Read the probe once."""
        reply = read_again(self._ask)
        return TemperatureReading(reply.number("temperature_degc"), time.monotonic())

    def close(self) -> None:
        """Close the socket."""
        self._line.close()

    def _ask(self) -> JsonReply:
        reply = ask_json(self._line, self._device, "conditions", {"op": "conditions"})
        if reply.yes("ok"):
            return reply
        raise Refused(self._device, "conditions", reply.word("message"))
