"""A Dimetix laser rangefinder on a serial port; the distance is a stage value of the world's.

``python -m drivers.emulators.dimetix_rangefinder --world HOST:PORT --sensor rod`` prints one ready
line with its port. Lines of ASCII, CR LF: ``s0g`` measures (``g0g+00012345``, tenths of a
millimetre), ``s0c`` clears (``g0?``), anything else is error 203 (``g0@E203``). Another
rangefinder's id is not answered. Source: Dimetix, Technical Reference Manual D-Series V1.06,
section 6.
"""

from __future__ import annotations

import argparse
import sys

from drivers.emulators.serial_instrument import Protocol, cut_lines, instrument_options, play
from drivers.emulators.wire_faults import Fault
from drivers.emulators.world_link import WorldLink

BAUD = 19200
WRONG_SYNTAX = 203
DISTANCE_OUT_OF_RANGE = 234
TENTH_MM = 1e-4
LARGEST = 99_999_999


class Rangefinder:
    """The instrument behind the wire."""

    def __init__(self, world: WorldLink, sensor: str, number: int) -> None:
        self._world = world
        self._sensor = sensor
        self._own = f"{number}"

    async def answer(self, request: bytes) -> bytes:
        """Follow one line."""
        line = request.decode("ascii", "replace")
        if line[:1] != "s" or line[1:2] != self._own:
            return b""
        match line[2:]:
            case "g":
                return self._line(await self._measure())
            case "c":
                return self._line("?")
            case _:
                return self._line(f"@E{WRONG_SYNTAX}")

    def error(self, reply: bytes, fault: Fault) -> bytes:
        """Put an error code in place of a distance."""
        del reply
        return self._line(f"@E{fault.code}")

    def other_id(self, reply: bytes, fault: Fault) -> bytes:
        """Reply as the rangefinder with the next number would."""
        del fault
        return b"g%d" % ((int(self._own) + 1) % 10) + reply[2:]

    async def _measure(self) -> str:
        reply = await self._world.ask("stage", sensor=self._sensor)
        tenths = round(reply["value"] / TENTH_MM)
        if abs(tenths) > LARGEST:
            return f"@E{DISTANCE_OUT_OF_RANGE}"
        return f"g{tenths:+09d}"

    def _line(self, text: str) -> bytes:
        return f"g{self._own}{text}\r\n".encode()


def make(world: WorldLink, options: argparse.Namespace) -> Protocol:
    """Put the rangefinder on the wire."""
    finder = Rangefinder(world, options.sensor, options.id)
    return Protocol(cut_lines, finder.answer, {"code": finder.error, "wrong_id": finder.other_id})


def main() -> int:
    """Run a rangefinder."""
    parser = instrument_options("An emulated Dimetix rangefinder on a serial port.", BAUD)
    parser.add_argument("--sensor", required=True, help="name of the world's stage value")
    parser.add_argument("--id", type=int, default=0, help="number set at its switch")
    return play(parser, make)


if __name__ == "__main__":
    sys.exit(main())
