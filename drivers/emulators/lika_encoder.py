"""A Lika absolute rotary encoder (EM58, ES58) as a Modbus RTU unit; its angle is a stage value.

``python -m drivers.emulators.lika_encoder --world HOST:PORT --sensor rod_angle`` prints one ready
line with its port. Input registers: 0 alarms, 1-2 position (counts, high word first), 10 status
word. Holding registers: 0-1 counts per turn, 2-3 counts in all. Source: Lika EM58/ES58 Modbus
manual, pages 58, 65, 80, 86.
"""

from __future__ import annotations

import argparse
import math
import sys

from drivers.emulators.rtu_wire import READ_HOLDING, READ_INPUT, Unit, cut_frames
from drivers.emulators.serial_instrument import Protocol, instrument_options, play
from drivers.emulators.wire_faults import Fault
from drivers.emulators.world_link import WorldLink

BAUD = 9600
COUNTS_PER_TURN = 4096
TURNS = 16384
ALARMS, POSITION, STATUS = 0, 1, 10


class Encoder:
    """The instrument behind the wire."""

    def __init__(self, world: WorldLink, sensor: str, number: int, per_turn: int) -> None:
        self._world = world
        self._sensor = sensor
        self._unit = Unit(number)
        self._per_turn = per_turn

    async def answer(self, request: bytes) -> bytes:
        """Follow one frame."""
        reply = await self._world.ask("stage", sensor=self._sensor)
        counts = round(reply["value"] / (2 * math.pi) * self._per_turn)
        total = self._per_turn * TURNS
        counts %= total
        measured = {
            **dict.fromkeys(range(STATUS + 1), 0),
            POSITION: counts >> 16,
            POSITION + 1: counts & 0xFFFF,
        }
        settings = {0: self._per_turn >> 16, 1: self._per_turn & 0xFFFF}
        settings |= {2: total >> 16, 3: total & 0xFFFF}
        return self._unit.answer(
            request, {READ_INPUT: lambda: measured, READ_HOLDING: lambda: settings}
        )

    def alarm(self, reply: bytes, fault: Fault) -> bytes:
        """Raise an alarm in the reply to a request for the alarm register alone."""
        if reply[2] != 2:
            return reply
        registers = {ALARMS: fault.code}
        frame = bytes([reply[0], READ_INPUT, 0, ALARMS, 0, 1])
        return self._unit.answer(frame, {READ_INPUT: lambda: registers})

    def protocol(self) -> Protocol:
        """Put the encoder on the wire."""
        return Protocol(cut_frames, self.answer, {**self._unit.spoils(), "alarm": self.alarm})


def make(world: WorldLink, options: argparse.Namespace) -> Protocol:
    """Put the encoder on the wire."""
    return Encoder(world, options.sensor, options.id, options.counts).protocol()


def main() -> int:
    """Run an encoder."""
    parser = instrument_options("An emulated Lika encoder on a serial port (Modbus RTU).", BAUD)
    parser.add_argument("--sensor", required=True, help="name of the world's stage value")
    parser.add_argument("--id", type=int, default=1, help="unit id")
    parser.add_argument("--counts", type=int, default=COUNTS_PER_TURN, help="counts per turn")
    return play(parser, make)


if __name__ == "__main__":
    sys.exit(main())
