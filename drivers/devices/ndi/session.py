"""The driver's side of one child process: start it, ask it with deadlines, kill it."""

from __future__ import annotations

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from drivers.errors import BadReply, DriverError, NoReply, Refused, Unreachable

NO_ROM = "-"
"""In place of a tool file: the tools are plugged in."""
CHILD = "drivers.devices.ndi.child"
KINDS: dict[str, type[DriverError]] = {
    kind.__name__: kind for kind in (BadReply, NoReply, Refused, Unreachable)
}


class Session:
    """One life of the child process."""

    def __init__(self, device: str, arguments: Sequence[str], deadline_s: float) -> None:
        self._device = device
        self._process = subprocess.Popen(
            [sys.executable, "-m", CHILD, *arguments, device],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self._answers: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._reading = threading.Thread(target=self._read, daemon=True, name="ndi")
        self._reading.start()
        try:
            self._expect("connect", deadline_s)
        except BaseException:
            self.end()
            raise

    @property
    def pid(self) -> int:
        """Process number of the child."""
        return self._process.pid

    def shots(self, count: int, deadline_s: float) -> list[list[float]]:
        """Ask for so many frames.

        Raises
        ------
        NoReply
            The child has ended or does not answer.
        DriverError
            What the child reports.
        """
        assert self._process.stdin is not None
        # A child that has ended may have left its reason behind.
        with suppress(BrokenPipeError):
            self._process.stdin.write(json.dumps({"shots": count}).encode() + b"\n")
            self._process.stdin.flush()
        poses: list[list[float]] = self._expect("BX", deadline_s)["shots"]
        return poses

    def end(self) -> None:
        """Kill the child; the sensor is found again at its own speed, whatever it did."""
        self._process.kill()
        self._process.wait()
        self._reading.join()
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdout.close()
        with suppress(BrokenPipeError):
            self._process.stdin.close()

    def _expect(self, command: str, deadline_s: float) -> dict[str, Any]:
        try:
            line = self._answers.get(timeout=deadline_s)
        except queue.Empty:
            raise NoReply(
                self._device,
                command,
                f"no whole reply within {deadline_s:g} s; check that the sensor is on, that no "
                "other program set its speed, and the cable",
            ) from None
        if not line:
            raise NoReply(
                self._device,
                command,
                f"the client process ended with status {self._process.wait()}: connect again",
            )
        answer: dict[str, Any] = json.loads(line)
        if answer["ok"]:
            return answer
        raise KINDS[answer["kind"]](self._device, answer["command"], answer["reason"])

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._answers.put(line)
        self._answers.put(b"")
