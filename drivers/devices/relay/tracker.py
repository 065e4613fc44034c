"""Tracker behind a host that relays one line of text a measurement, over a serial port.

Leica AT9x0, FARO and API trackers speak only their vendors' interfaces; a program on the tracker's
host writes the lines, in the form that a profile says. A line is used only when it is of a
measurement that began after it was asked for: it bears the trigger's number, or, where lines come
by themselves, it is not the one under way and its count moves on. Never tried on an instrument.
"""

from __future__ import annotations

import math
import random
import re
import statistics
import time

from drivers.addresses import Address
from drivers.devices.relay.line_profile import (
    NUMBER,
    Complaint,
    LineError,
    LineProfile,
    Measurement,
)
from drivers.errors import BadReply, NoReply, Refused
from drivers.interfaces import TrackerReading
from drivers.serial_text import SerialText
from drivers.transport import read_again

PROFILE = "relay_triggered_6d"
SHOTS = 3
REPLY_TIMEOUT_S = 2.0
ANYTHING = re.compile(rb".+")
NUMBERS = 1_000_000
"""Trigger numbers start again after so many."""


class RelayTracker:
    """A tracker's host at a serial port.

    Parameters
    ----------
    address
        Name of the serial port; options `profile` (relay_triggered_6d, relay_streamed_3d, or the
        path of one's own), and `baud` and `serial` where they differ from the profile's.
    shots
        Lines that one reading averages.
    reply_timeout_s
        Longest wait for one line [s].
    first_number
        Of the triggers; drawn if None, so that a line to an earlier program's trigger, late or
        repeated, bears another number.
    """

    def __init__(
        self,
        address: str,
        *,
        shots: int = SHOTS,
        reply_timeout_s: float = REPLY_TIMEOUT_S,
        first_number: int | None = None,
    ) -> None:
        if shots < 1:
            raise ValueError(f"shots must be at least 1, not {shots}")
        self._device = f"tracker relay at {address}"
        where = Address(self._device, address, "profile", "baud", "serial")
        self._profile = LineProfile.read(self._device, where.word("profile", PROFILE))
        self._shots = shots
        self._timeout_s = reply_timeout_s
        self._line = SerialText(
            self._device,
            where.place,
            where.whole("baud", self._profile.baud),
            reply_timeout_s,
            where.word("serial", self._profile.serial),
        )
        drawn = random.randrange(NUMBERS) if first_number is None else first_number
        self._number: int | None = drawn - 1

    def connect(self) -> None:
        """Open the port and see that lines of the profile's form come.

        A host that cannot measure at the moment is there all the same.
        """
        self._line.open()
        try:
            read_again(self._one_reading)
        except Refused:
            return

    def measure(self) -> TrackerReading:
        """Take several lines and average them; a missing or garbled one is asked for again.

        Raises
        ------
        Refused
            If the host says that it could not measure; the reason says what to do.
        NoReply, BadReply, Unreachable
            If the line fails, or the same measurement comes again and again.
        """
        taken = read_again(self._one_reading)
        axes = [*zip(*(one.position for one in taken), strict=True)]
        x, y, z = (statistics.fmean(axis) for axis in axes)
        spread = max(statistics.stdev(axis) for axis in axes) if len(taken) > 1 else 0.0
        turn = _mean_turn([one.orientation for one in taken if one.orientation is not None])
        return TrackerReading((x, y, z), turn, spread, len(taken), time.monotonic())

    def close(self) -> None:
        """Close the port if open."""
        self._line.close()

    def _one_reading(self) -> list[Measurement]:
        if self._profile.trigger is not None:
            return [self._triggered(self._profile.trigger) for _ in range(self._shots)]
        self._line.forget_stream("listen")
        # The rest of a line whose measurement began before it was asked for.
        self._line.skip_line("listen")
        # Not used either: a host that stands still would repeat it.
        raw = self._line.listen("listen", ANYTHING)[0]
        self._number = self._understand("listen", raw).number
        return [self._streamed() for _ in range(self._shots)]

    def _triggered(self, trigger: str) -> Measurement:
        number = self._number = (self._number or 0) % NUMBERS + 1
        request = trigger.replace(NUMBER, str(number)).encode()
        command = request.decode("ascii")
        end_s = time.monotonic() + self._timeout_s
        raw = self._line.ask(command, request, ANYTHING)[0]
        while True:
            said = self._understand(command, raw)
            if NUMBER not in trigger or said.number == self._number:
                return self._accept(command, raw, said)
            if time.monotonic() > end_s:
                self._line.doubt()
                raise BadReply(
                    self._device,
                    command,
                    f"the line bears number {said.number} and not {self._number}; see that only "
                    "this program triggers the tracker",
                    raw,
                )
            raw = self._line.listen(command, ANYTHING)[0]

    def _streamed(self) -> Measurement:
        end_s = time.monotonic() + self._timeout_s
        while True:
            raw = self._line.listen("listen", ANYTHING)[0]
            said = self._understand("listen", raw)
            if said.number != self._number:
                self._number = said.number
                return self._accept("listen", raw, said)
            if time.monotonic() > end_s:
                raise NoReply(
                    self._device,
                    "listen",
                    f"measurement {said.number} comes again and again, so it is old; start the "
                    "program of the tracker's host again",
                    raw,
                )

    def _understand(self, command: str, raw: bytes) -> Measurement | Complaint:
        try:
            return self._profile.understand(raw)
        except LineError as fault:
            self._line.doubt()
            raise BadReply(
                self._device, command, f"{fault}; check cable, speed and profile", raw
            ) from fault

    def _accept(self, command: str, raw: bytes, said: Measurement | Complaint) -> Measurement:
        if isinstance(said, Complaint):
            raise Refused(self._device, command, f"error {said.code}: {said.advice}", raw)
        return said


def _mean_turn(
    turns: list[tuple[float, float, float, float]],
) -> tuple[float, float, float, float] | None:
    """Average orientations that differ by noise: quaternions on one side, summed, made unit."""
    if not turns:
        return None
    total = [0.0] * 4
    for turn in turns:
        side = 1.0 if sum(a * b for a, b in zip(turn, turns[0], strict=True)) >= 0.0 else -1.0
        total = [a + side * b for a, b in zip(total, turn, strict=True)]
    length = math.hypot(*total)
    w, x, y, z = (number / length for number in total)
    return w, x, y, z
