"""A Pt100 transmitter as a Modbus RTU unit; it feels the temperature of the world's robot.

``python -m drivers.emulators.temperature_transmitter --world HOST:PORT`` prints one ready line with
its port. Input register 0: temperature in hundredths of a degree Celsius, 16 bits with sign; 32767
for a broken sensor. It is nobody's product: such registers are what transmitters have alike.
"""

from __future__ import annotations

import argparse
import sys

from drivers.emulators.rtu_wire import READ_INPUT, Unit, cut_frames
from drivers.emulators.serial_instrument import Protocol, instrument_options, play
from drivers.emulators.wire_faults import Fault
from drivers.emulators.world_link import WorldLink

BAUD = 9600
PER_DEGREE = 100
SENSOR_BROKEN = 0x7FFF


class Transmitter:
    """The instrument behind the wire."""

    def __init__(self, world: WorldLink, number: int) -> None:
        self._world = world
        self._unit = Unit(number)

    async def answer(self, request: bytes) -> bytes:
        """Follow one frame."""
        reply = await self._world.ask("conditions")
        raw = round(reply["temperature_degc"] * PER_DEGREE) & 0xFFFF
        return self._unit.answer(request, {READ_INPUT: lambda: {0: raw}})

    def broken(self, reply: bytes, fault: Fault) -> bytes:
        """Reply as with a broken sensor."""
        del fault
        request = bytes([reply[0], READ_INPUT, 0, 0, 0, 1])
        return self._unit.answer(request, {READ_INPUT: lambda: {0: SENSOR_BROKEN}})

    def protocol(self) -> Protocol:
        """Put the transmitter on the wire."""
        spoils = {**self._unit.spoils(), "sensor_broken": self.broken}
        return Protocol(cut_frames, self.answer, spoils)


def make(world: WorldLink, options: argparse.Namespace) -> Protocol:
    """Put the transmitter on the wire."""
    return Transmitter(world, options.id).protocol()


def main() -> int:
    """Run a transmitter."""
    parser = instrument_options("An emulated Pt100 transmitter on a serial port.", BAUD)
    parser.add_argument("--id", type=int, default=1, help="unit id")
    return play(parser, make)


if __name__ == "__main__":
    sys.exit(main())
