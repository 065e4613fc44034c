"""Lika absolute rotary encoder (EM58, ES58) over Modbus RTU, through `pymodbus`.

``01 04 00 01 00 02 20 0B`` is answered by ``01 04 04 00 00 2F F0 E7 F0``: 12272 counts, high word
first. Input register 0 holds the alarms and is read with every position; the counts per turn and in
all stand in the holding registers 0 to 3 and are read once. Source: Lika EM58/ES58 Modbus manual,
pages 58, 65, 80, 86. Speed and frame are from memory. Never tried on an instrument.
"""

from __future__ import annotations

import math
import time

from drivers.addresses import Address
from drivers.errors import BadReply, Refused
from drivers.interfaces import StageReading
from drivers.modbus_link import Table, over_serial
from drivers.transport import EIGHT_BITS, read_again

BAUD = 9600
UNIT = 1
REPLY_TIMEOUT_S = 0.5
ALARMS, POSITION = 0, 1
"""Input registers."""
COUNTS = 0
"""First of the holding registers with the counts per turn and in all."""


class LikaEncoder:
    """An encoder at a serial port; reads the angle [rad].

    Angles of more than half of the encoder's whole range count as negative: just below its zero an
    encoder reads its largest count.

    Parameters
    ----------
    address
        Name of the serial port; options `id` (1), `baud` (9600), `frame` (8N1).
    sensor
        What it is called in the stage's settings.
    reply_timeout_s
        Longest wait for a reply [s].
    """

    def __init__(
        self, address: str, sensor: str, *, reply_timeout_s: float = REPLY_TIMEOUT_S
    ) -> None:
        self._device = f"stage sensor {sensor} lika at {address}"
        where = Address(self._device, address, "id", "baud", "frame")
        self._link = over_serial(
            self._device,
            where.place,
            where.whole("baud", BAUD),
            where.word("frame", EIGHT_BITS),
            where.whole("id", UNIT),
            reply_timeout_s,
        )
        self._per_turn = 0
        self._in_all = 0

    def connect(self) -> None:
        """Open the port and read the encoder's scale."""
        self._link.open()
        counts = read_again(lambda: self._link.read("read scale", Table.holding, COUNTS, 4))
        self._per_turn = counts[0] << 16 | counts[1]
        self._in_all = counts[2] << 16 | counts[3]
        if not 0 < self._per_turn <= self._in_all:
            raise BadReply(
                self._device,
                "read scale",
                f"{self._per_turn} counts per turn and {self._in_all} in all make no encoder; "
                "check the unit id",
            )

    def read(self) -> StageReading:
        """Read alarms and position once; a missing or garbled reply is asked again.

        Raises
        ------
        Refused
            If the encoder raises an alarm or answers with an exception code.
        NoReply, BadReply, Unreachable
            If the line fails.
        """
        (alarms,) = read_again(lambda: self._link.read("read alarms", Table.input, ALARMS, 1))
        if alarms:
            raise Refused(
                self._device,
                "read alarms",
                f"the encoder raises alarm {alarms:#06x}: look it up in its manual, check its "
                "settings and set its zero again",
            )
        high, low = read_again(lambda: self._link.read("read position", Table.input, POSITION, 2))
        counts = high << 16 | low
        if counts >= self._in_all:
            raise BadReply(
                self._device,
                "read position",
                f"{counts} counts where there are {self._in_all} in all; connect again, since the "
                "encoder's scale was changed",
            )
        if 2 * counts > self._in_all:
            counts -= self._in_all
        return StageReading(counts / self._per_turn * math.tau, 0.0, time.monotonic())

    def close(self) -> None:
        """Close the port if open."""
        self._link.close()
