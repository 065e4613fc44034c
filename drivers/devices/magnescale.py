"""Magnescale gauge interface (U12B) over a serial line: ``R`` is answered by ``RNM +012.345``.

Third character M for millimetres or I for inches; a space, the sign and seven characters of length
follow. There is no checksum. Source: Magnescale U12B manual, page 35. That the second character N
stands for a sound reading is an inference; anything else there is refused. Speed and frame are from
memory. Never tried on an instrument.
"""

from __future__ import annotations

import re
import time

from drivers.addresses import Address
from drivers.errors import Refused
from drivers.interfaces import StageReading
from drivers.serial_text import SerialText
from drivers.transport import EIGHT_BITS, read_again

BAUD = 9600
REPLY_TIMEOUT_S = 0.5
UNITS = {b"M": 1e-3, b"I": 0.0254}
"""[m]"""
READING = re.compile(rb"R(.)([MI]) ([+-])(?=.{7}$)(\d+\.\d+)")
SOUND = b"N"


class MagnescaleGauge:
    """A length gauge at a serial port; reads the length [m].

    Parameters
    ----------
    address
        Name of the serial port; options `baud` (9600), `frame` (8N1).
    sensor
        What it is called in the stage's settings.
    reply_timeout_s
        Longest wait for a reply [s].
    """

    def __init__(
        self, address: str, sensor: str, *, reply_timeout_s: float = REPLY_TIMEOUT_S
    ) -> None:
        self._device = f"stage sensor {sensor} magnescale at {address}"
        where = Address(self._device, address, "baud", "frame")
        self._line = SerialText(
            self._device,
            where.place,
            where.whole("baud", BAUD),
            reply_timeout_s,
            where.word("frame", EIGHT_BITS),
        )

    def connect(self) -> None:
        """Open the port and see that a gauge answers."""
        self._line.open()
        self.read()

    def read(self) -> StageReading:
        """Read the length once; a missing or garbled reply is asked again.

        Raises
        ------
        Refused
            If the interface does not vouch for the reading.
        NoReply, BadReply, Unreachable
            If the line fails.
        """
        reply = read_again(lambda: self._line.ask("R", b"R", READING))
        if reply[1] != SOUND:
            raise Refused(
                self._device,
                "R",
                f"the gauge marks its reading {reply[1].decode('ascii', 'replace')} and not N: "
                "read its display, check the gauge's cable and set its origin again",
                reply[0],
            )
        length = float(reply[3] + reply[4]) * UNITS[reply[2]]
        return StageReading(length, 0.0, time.monotonic())

    def close(self) -> None:
        """Close the port if open."""
        self._line.close()
