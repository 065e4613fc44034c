"""Dimetix laser rangefinder over a serial line: ``s0g`` CR LF is answered by ``g0g+00012345``.

Tenths of a millimetre with sign; an error is ``g0@E255``; ``g0?`` answers a clear and is also what
the sensor says after power-on. There is no checksum and no number that ties a reply to its
request, so after a failure the sensor is told to clear (``s0c``), whose answer cannot be taken for
a distance.

Sources: Dimetix, Technical Reference Manual D-Series V1.06, sections 6.2 and 6.6, and DLS-C,
section 9. Speed and frame as set in the factory are from memory. Never tried on an instrument.
"""

from __future__ import annotations

import re
import statistics
import time

from drivers.addresses import Address
from drivers.errors import BadReply, Refused
from drivers.interfaces import StageReading
from drivers.serial_text import SerialText
from drivers.transport import read_again

BAUD = 19200
FRAME = "7E1"
TENTH_MM = 1e-4
SHOTS = 5
REPLY_TIMEOUT_S = 4.0
"""On dark targets a natural target takes up to this long [s]."""
DISTANCE = re.compile(rb"g(\d)(?:g([+-]\d{8})|@E(\d{3}))")
CLEARED = re.compile(rb"g(\d)\?|g(\d)@E(\d{3})")

ADVICE = {
    203: "wrong command or parameter: is this a Dimetix sensor of the D, DLS or FLS series?",
    210: "not in tracking mode: switch it off and on",
    211: "set a longer sampling time at the sensor",
    212: "it tracks by itself: clear its auto-start",
    220: "communication error: check its speed, parity and id",
    230: "the distance overflows: check the user offset and gain at the sensor",
    231: "wrong mode of its digital input: activate the input",
    232: "its output is configured as an input: check its settings",
    233: "the number cannot be displayed: check its output format",
    234: "the distance is out of range: check what the beam falls on",
    236: "its output is configured as an input: check its settings",
    252: "too hot: let it cool",
    253: "too cold: let it warm up",
    254: "bad signal, measuring takes too long: use a white or reflecting target",
    255: "the signal is too weak: clear the beam, aim at the target, use a brighter one",
    256: "the signal is too strong: use a duller target",
    258: "its supply voltage is too high: check the power supply",
    259: "its supply voltage is too low: check the power supply",
    260: "several targets in the beam: clear it",
    263: "too much light: shade the target, use the maker's target plate",
    264: "too much light for a reflecting target: shade it",
    330: "the target moved: let it stand still",
    331: "the target moved too fast: let it stand still",
    360: "the configured measuring time is too short: set a longer one",
    361: "the configured measuring time is too long: set a shorter one",
}
"""Error codes and what to do about them."""


class DimetixRangefinder:
    """A rangefinder at a serial port; reads the distance [m].

    Parameters
    ----------
    address
        Name of the serial port; options `id` (0), `baud` (19200), `frame` (7E1).
    sensor
        What it is called in the stage's settings.
    shots
        Measurements that one reading averages.
    reply_timeout_s
        Longest wait for one measurement [s].
    """

    def __init__(
        self,
        address: str,
        sensor: str,
        *,
        shots: int = SHOTS,
        reply_timeout_s: float = REPLY_TIMEOUT_S,
    ) -> None:
        if shots < 1:
            raise ValueError(f"shots must be at least 1, not {shots}")
        self._device = f"stage sensor {sensor} dimetix at {address}"
        where = Address(self._device, address, "id", "baud", "frame")
        self._number = where.whole("id", 0)
        self._shots = shots
        self._line = SerialText(
            self._device,
            where.place,
            where.whole("baud", BAUD),
            reply_timeout_s,
            where.word("frame", FRAME),
        )
        self._clear = True

    def connect(self) -> None:
        """Open the port and clear the sensor, which stops a measurement that it may be doing."""
        self._line.open()
        self._clear = True
        read_again(self._stop)

    def read(self) -> StageReading:
        """Measure several times; a missing or garbled reply is asked again.

        Raises
        ------
        Refused
            With the sensor's error code and what to do about it.
        NoReply, BadReply, Unreachable
            If the line fails.
        """
        distances = [read_again(self._measure) for _ in range(self._shots)]
        spread = statistics.stdev(distances) if len(distances) > 1 else 0.0
        return StageReading(statistics.fmean(distances), spread, time.monotonic())

    def close(self) -> None:
        """Close the port if open."""
        self._line.close()

    def _measure(self) -> float:
        if self._clear:
            self._stop()
        reply = self._ask("sNg", b"g", DISTANCE)
        return int(reply[2]) * TENTH_MM

    def _stop(self) -> None:
        self._ask("sNc", b"c", CLEARED)

    def _ask(self, command: str, letter: bytes, pattern: re.Pattern[bytes]) -> re.Match[bytes]:
        self._clear = True
        reply = self._line.ask(command, b"s%d%s" % (self._number, letter), pattern)
        number, code = int(reply[1] or reply[2]), reply[3]
        if number != self._number:
            self._line.doubt()
            raise BadReply(
                self._device,
                command,
                f"sensor {number} replied and not {self._number}; check the ids",
                reply[0],
            )
        self._clear = False
        if code is not None:
            advice = ADVICE.get(int(code), "look it up in the sensor's manual")
            raise Refused(self._device, command, f"error {int(code)}, {advice}", reply[0])
        return reply
