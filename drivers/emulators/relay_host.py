"""A tracker's host that relays one line of text a measurement, over a serial port.

``python -m drivers.emulators.relay_host --world HOST:PORT --form triggered_6d`` prints one ready
line with its port. Two forms: `triggered_6d` answers ``M 17`` by
``$LT,17,1234.5670,...*5A`` (millimetres, quaternion, NMEA checksum) or ``$LE,17,BEAM*..``;
`streamed_3d` sends ``P 00000017 +002.3456780 +001.2345670 -000.4567890`` by itself (metres, x and y
exchanged, z down) or ``E 00000017 1``. Nobody's product.
"""

from __future__ import annotations

import argparse
import asyncio
import re
import sys
from collections.abc import Callable
from typing import Any

from drivers.emulators.serial_instrument import Protocol, cut_lines, instrument_options, play
from drivers.emulators.wire_faults import Fault
from drivers.emulators.world_link import WorldLink

BAUD = 115200
TRIGGER = re.compile(rb"M (\d+)")
LINES_PER_S = 20


class TriggeredHost:
    """Measures when it is told to, and numbers its line as the trigger was."""

    def __init__(self, world: WorldLink) -> None:
        self._world = world

    async def answer(self, request: bytes) -> bytes:
        """Follow one trigger."""
        found = TRIGGER.fullmatch(request)
        if found is None:
            return b""
        number = found[1].decode()
        reading = await self._world.ask("measure")
        if not reading["ok"]:
            return _closed(f"LE,{number},BEAM")
        point = ",".join(f"{x * 1e3:.4f}" for x in reading["position"])
        turn = ",".join(f"{q:.9f}" for q in reading["orientation"])
        return _closed(f"LT,{number},{point},{turn}")

    def protocol(self) -> Protocol:
        """Put the host on the wire."""
        return Protocol(
            cut_lines,
            self.answer,
            {
                "wrong_checksum": _wrong_checksum,
                "wrong_id": _other_number,
                "code": lambda reply, _: _closed(f"LE,{reply.split(b',')[1].decode()},WARM"),
            },
        )


class StreamingHost:
    """Measures at a steady rate."""

    def __init__(self, world: WorldLink) -> None:
        self._world = world
        self._count = 0

    async def answer(self, request: bytes) -> bytes:
        """Take no requests."""
        del request
        return b""

    async def stream(self, say: Callable[[bytes], None]) -> None:
        """Send lines for ever."""
        while True:
            await asyncio.sleep(1.0 / LINES_PER_S)
            self._count += 1
            say(self._line(await self._world.ask("measure")))

    def protocol(self) -> Protocol:
        """Put the host on the wire."""
        error = {"code": lambda reply, _: b"E " + reply[2:10] + b" 7\r\n"}
        return Protocol(cut_lines, self.answer, error, self.stream)

    def _line(self, reading: dict[str, Any]) -> bytes:
        if not reading["ok"]:
            return f"E {self._count:08d} 1\r\n".encode()
        x, y, z = reading["position"]
        point = " ".join(f"{value:+012.7f}" for value in (y, x, -z))
        return f"P {self._count:08d} {point}\r\n".encode()


HOSTS: dict[str, type[TriggeredHost] | type[StreamingHost]] = {
    "triggered_6d": TriggeredHost,
    "streamed_3d": StreamingHost,
}


def _closed(body: str) -> bytes:
    check = 0
    for byte in body.encode():
        check ^= byte
    return f"${body}*{check:02X}\r\n".encode()


def _wrong_checksum(reply: bytes, fault: Fault) -> bytes:
    del fault
    head, star, check = reply.partition(b"*")
    return head + star + (b"00" if check[:2] != b"00" else b"01") + check[2:]


def _other_number(reply: bytes, fault: Fault) -> bytes:
    del fault
    body = reply[1:].partition(b"*")[0].decode().split(",")
    body[1] = str(int(body[1]) + 500)
    return _closed(",".join(body))


def make(world: WorldLink, options: argparse.Namespace) -> Protocol:
    """Put the chosen host on the wire."""
    host: TriggeredHost | StreamingHost = HOSTS[options.form](world)
    return host.protocol()


def main() -> int:
    """Run a host."""
    parser = instrument_options("An emulated tracker's host on a serial port.", BAUD)
    parser.add_argument("--form", choices=sorted(HOSTS), default="triggered_6d")
    return play(parser, make)


if __name__ == "__main__":
    sys.exit(main())
