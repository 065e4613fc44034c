"""A program that runs beside this one: says in one line of JSON that it is ready, ends with us."""

import json
import queue
import subprocess
import sys
import threading
from collections.abc import Mapping
from typing import Any

START_S = 30.0
"""Longest start of a program, on a busy machine [s]"""
END_S = 10.0


class StartFailed(RuntimeError):
    """The program did not say that it is ready."""


class ChildProcess:
    """`python -m MODULE ARGUMENTS`, with its standard input held open as its reason to live."""

    def __init__(
        self, module: str, *arguments: str, environment: Mapping[str, str] | None = None
    ) -> None:
        self._name = module
        self._process = subprocess.Popen(
            [sys.executable, "-m", module, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            # Ctrl+C is for the program in front, which ends the others in their order.
            start_new_session=True,
        )
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self._lines.put(line)
        self._lines.put("")

    def ready(self) -> dict[str, Any]:
        """Wait for the ready line and return it.

        Raises
        ------
        StartFailed
            If the program ends or stays silent instead.
        """
        try:
            line = self._lines.get(timeout=START_S)
        except queue.Empty:
            self.close()
            raise StartFailed(f"{self._name} did not start within {START_S:.0f} s") from None
        if not line:
            self.close()
            raise StartFailed(
                f"{self._name} ended with status {self._process.wait()} before it was ready"
            )
        answer: dict[str, Any] = json.loads(line)
        return answer

    def order(self, order: Mapping[str, object]) -> dict[str, Any]:
        """Write one line of JSON to its standard input and return the line that it answers.

        Raises
        ------
        StartFailed
            If the program has ended or stays silent instead.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(order) + "\n")
            self._process.stdin.flush()
            line = self._lines.get(timeout=END_S)
        except (OSError, queue.Empty):
            line = ""
        if not line:
            raise StartFailed(f"{self._name} does not answer any more")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def wait(self) -> int:
        """Wait until it ends by itself."""
        return self._process.wait()

    def close(self) -> None:
        """Close its standard input, ask it to end, and make sure that it does."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.terminate()
        try:
            self._process.wait(END_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(END_S)
        if not self._reader.is_alive():
            # A grandchild that holds the pipe would keep the reader, and closing would wait for it.
            assert self._process.stdout is not None
            self._process.stdout.close()
