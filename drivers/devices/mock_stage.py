"""Sensor of the emulated calibration stage, over one plain socket to the world."""

from __future__ import annotations

from drivers.errors import Refused
from drivers.interfaces import StageReading
from drivers.transport import JsonReply, LineSocket, ask_json, read_again

REPLY_TIMEOUT_S = 2.0


class MockStageSensor:
    """One stage sensor, by its name in the world's configuration, at the world's ``host:port``."""

    def __init__(self, address: str, sensor: str) -> None:
        self._device = f"stage sensor {sensor} mock at {address}"
        self._sensor = sensor
        self._line = LineSocket(self._device, address, REPLY_TIMEOUT_S)

    def connect(self) -> None:
        """Open the socket and see that the world has this sensor."""
        self._line.open()
        self.read()

    def read(self) -> StageReading:
        """Read the sensor once."""
        reply = read_again(self._ask)
        return StageReading(reply.number("value"), 0.0, reply.number("time_s"))

    def close(self) -> None:
        """Close the socket."""
        self._line.close()

    def _ask(self) -> JsonReply:
        request = {"op": "stage", "sensor": self._sensor}
        reply = ask_json(self._line, self._device, "read", request)
        if reply.yes("ok"):
            return reply
        raise Refused(self._device, "read", reply.word("message"))
