"""A Magnescale gauge interface (U12B) on a serial port; its length is a stage value of the world's.

``python -m drivers.emulators.magnescale_gauge --world HOST:PORT --sensor slide`` prints one ready
line with its port. ``R`` CR LF is answered by ``RNM -123.456`` CR LF: N for a sound reading, M for
millimetres (I for inches), a space, the sign, seven characters of length. Source: Magnescale U12B
manual, page 35; what stands in place of N when the gauge is not sound is a guess.
"""

from __future__ import annotations

import argparse
import sys

from drivers.emulators.serial_instrument import Protocol, cut_lines, instrument_options, play
from drivers.emulators.wire_faults import Fault
from drivers.emulators.world_link import WorldLink

BAUD = 9600
UNITS = {"mm": ("M", 1e-3, 3), "inch": ("I", 0.0254, 5)}
"""Letter, length of the unit [m], decimals."""


class Gauge:
    """The instrument behind the wire."""

    def __init__(self, world: WorldLink, sensor: str, unit: str) -> None:
        self._world = world
        self._sensor = sensor
        self._letter, self._metres, self._decimals = UNITS[unit]

    async def answer(self, request: bytes) -> bytes:
        """Follow one line; other commands than R are not emulated and not answered."""
        if request != b"R":
            return b""
        reply = await self._world.ask("stage", sensor=self._sensor)
        length = round(reply["value"] / self._metres, self._decimals)
        sign = "-" if length < 0 else "+"
        return f"RN{self._letter} {sign}{abs(length):07.{self._decimals}f}\r\n".encode()

    @staticmethod
    def error(reply: bytes, fault: Fault) -> bytes:
        """Mark a reading as not sound."""
        del fault
        return reply[:1] + b"E" + reply[2:]


def make(world: WorldLink, options: argparse.Namespace) -> Protocol:
    """Put the gauge on the wire."""
    gauge = Gauge(world, options.sensor, options.unit)
    return Protocol(cut_lines, gauge.answer, {"code": gauge.error})


def main() -> int:
    """Run a gauge."""
    parser = instrument_options("An emulated Magnescale gauge on a serial port.", BAUD)
    parser.add_argument("--sensor", required=True, help="name of the world's stage value")
    parser.add_argument("--unit", choices=sorted(UNITS), default="mm")
    return play(parser, make)


if __name__ == "__main__":
    sys.exit(main())
