"""The process that holds `ndicapi`: ``python -m drivers.devices.ndi.child PORT TOOL ROM DEVICE``.

The library waits 5 s for each missing reply and holds the interpreter's lock meanwhile; in a
process of its own it can be killed. Standard input takes one JSON line a request, ``{"shots": 3}``;
standard output gives one line each: first whether the sensor is ready, then the shots, or an error.
"""

from __future__ import annotations

import json
import os
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import ndicapy

if sys.platform != "win32":
    import termios

from drivers.devices.ndi.codes import ADVICE, READ_FAILED, TIMED_OUT, WRITE_FAILED, WRONG_CRC
from drivers.devices.ndi.session import NO_ROM
from drivers.errors import BadReply, DriverError, NoReply, Refused, Unreachable
from drivers.transport import EIGHT_BITS, open_serial

BAUD = 9600
"""What every sensor speaks after power-on; kept, so that a new start always finds it again."""
CONTROL = 6
"""Place of the control characters in what `tcgetattr` returns."""
PASSIVE_TOOL = "PHRQ:*********1****"
NEW_FRAME_S = 0.5
"""Longest time for a new frame, of which a sensor makes 20 and more a second [s]."""
TRACK_S = 0.4
"""Longest wait for the next bytes of a reply while tracking; before, the library's 5 s hold [s]."""
GONE_S = 0.2
"""A read that ends sooner without a byte has not timed out: the port is gone [s]."""


class Sensor:
    """One opened and tracking position sensor with one tool."""

    def __init__(self, device: str, port: str, tool: int, rom: str) -> None:
        self._device = device
        # The library's own lock does not keep other programs out.
        self._lock = open_serial(device, port, BAUD, TRACK_S, EIGHT_BITS)
        self._sensor = ndicapy.ndiOpen(port)
        if not self._sensor:
            raise Unreachable(
                device, "open", f"the library does not open {port}; check the cable and its name"
            )
        with suppress(Refused):
            # Left tracking by a program that was killed; else this is refused.
            self._ask("TSTOP:")
        self._ask("INIT:")
        if rom != NO_ROM:
            self._load(rom)
        self._handle = self._enable(tool)
        self._frame = -1
        self._ask("TSTART:")
        self._wait_less()

    def shots(self, count: int) -> list[list[float]]:
        """Read the tool in so many frames: quaternion w, x, y, z, then position [mm]."""
        return [self._shot() for _ in range(count)]

    def _shot(self) -> list[float]:
        end_s = time.monotonic() + NEW_FRAME_S
        handle = bytes([self._handle])
        while True:
            self._ask_pose()
            pose = ndicapy.ndiGetBXTransform(self._sensor, handle)
            if pose == "DISABLED":
                raise Refused(
                    self._device, "BX", "the tool is disabled; plug it in and connect again"
                )
            frame = int(ndicapy.ndiGetBXFrame(self._sensor, handle))
            if frame != self._frame:
                break
            if time.monotonic() > end_s:
                raise NoReply(
                    self._device,
                    "BX",
                    f"frame {frame} comes again for {NEW_FRAME_S:g} s, so the values are old; "
                    "switch the sensor off and on",
                )
        self._frame = frame
        if pose == "MISSING":
            raise Refused(
                self._device,
                "BX",
                "the tool is missing: clear the line of sight, move it into the sensor's volume, "
                "clean its markers",
            )
        return [float(number) for number in pose[:7]]

    def _ask_pose(self) -> None:
        """Ask for the binary pose; where that fails, for the text, whose errors the library reads.

        It takes an error code in reply to BX for a binary reply with a wrong checksum.
        """
        try:
            self._ask("BX:0001")
        except (NoReply, BadReply) as first:
            try:
                self._ask("TX:0001")
            except (NoReply, BadReply):
                raise first from None
            raise

    def _wait_less(self) -> None:
        """Shorten the library's wait, which belongs to the port and not to its handle."""
        if sys.platform != "win32":
            attributes = termios.tcgetattr(self._lock)
            attributes[CONTROL][termios.VTIME] = round(TRACK_S * 10)
            termios.tcsetattr(self._lock, termios.TCSANOW, attributes)

    def _load(self, rom: str) -> None:
        if not Path(rom).is_file():
            raise Refused(self._device, "PVWR", f"there is no tool file {rom}; check its path")
        self._ask(PASSIVE_TOOL)
        handle = int(ndicapy.ndiGetPHRQHandle(self._sensor))
        try:
            ndicapy.ndiPVWRFromFile(self._sensor, handle, rom)
        except OSError as fault:
            raise self._error("PVWR", int(ndicapy.ndiGetError(self._sensor)), soon=False) from fault

    def _enable(self, tool: int) -> int:
        for handle in self._handles("02"):
            self._ask(f"PINIT:{handle:02X}")
        for handle in self._handles("03"):
            self._ask(f"PENA:{handle:02X}D")
        enabled = sorted(self._handles("04"))
        if not 1 <= tool <= len(enabled):
            raise Refused(
                self._device,
                "PHSR",
                f"there are {len(enabled)} tools and number {tool} is wanted; plug the tool in, or "
                "name its file with the option rom=... if it is passive",
            )
        return enabled[tool - 1]

    def _handles(self, kind: str) -> list[int]:
        self._ask(f"PHSR:{kind}")
        count = ndicapy.ndiGetPHSRNumberOfHandles(self._sensor)
        return [int(ndicapy.ndiGetPHSRHandle(self._sensor, i)) for i in range(count)]

    def _ask(self, command: str) -> None:
        """Send a command; the library raises OSError and keeps the code."""
        began_s = time.monotonic()
        try:
            ndicapy.ndiCommand(self._sensor, command)
        except OSError as fault:
            code = int(ndicapy.ndiGetError(self._sensor))
            soon = time.monotonic() - began_s < GONE_S
            raise self._error(command.partition(":")[0], code, soon=soon) from fault

    def _error(self, name: str, code: int, *, soon: bool) -> DriverError:
        if code in {READ_FAILED, WRITE_FAILED} or (code == TIMED_OUT and soon):
            return Unreachable(
                self._device, name, "the serial port is gone; plug it in again, check the cable"
            )
        if code == TIMED_OUT:
            return NoReply(
                self._device, name, "no reply; check that the sensor is on and the cable"
            )
        if code == WRONG_CRC:
            return BadReply(
                self._device, name, "the reply's checksum is wrong; check the cable and its shield"
            )
        advice = ADVICE.get(code, "look it up in the sensor's API guide")
        return Refused(self._device, name, f"error {code:02X}, {advice}")


def main() -> None:
    """Open the sensor, then serve until standard input closes."""
    port, tool, rom, device = sys.argv[1:]
    # Whatever the library prints must not be taken for an answer.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())

    def say(**answer: Any) -> None:  # noqa: ANN401 - a JSON object
        answers.write(json.dumps(answer) + "\n")
        answers.flush()

    def report(error: DriverError) -> None:
        say(ok=False, kind=type(error).__name__, command=error.command, reason=error.reason)

    try:
        sensor = Sensor(device, port, int(tool), rom)
    except DriverError as error:
        report(error)
        return
    say(ok=True)
    for line in sys.stdin:
        try:
            say(ok=True, shots=sensor.shots(json.loads(line)["shots"]))
        except DriverError as error:
            report(error)


if __name__ == "__main__":
    main()
