"""What the driver and its child process say to each other: pickled dataclasses over two pipes.

The driver asks, the child answers each request with one message; a `DriverError` as answer is
raised in the driver. A closed pipe means that the other side has gone.
"""

import pickle
import queue
import threading
from dataclasses import dataclass
from typing import IO

from drivers.interfaces import RobotState


@dataclass(frozen=True)
class AskState:
    """Answered by `RobotState`."""


@dataclass(frozen=True)
class StartMotion:
    """Answered by `Done` when the controller has taken the motion."""

    joints: tuple[float, ...]
    """[rad]"""
    speed: float
    """[rad/s]"""
    acceleration: float
    """[rad/s2]"""


@dataclass(frozen=True)
class AskProgress:
    """Answered by `Progress`. Keeps the motion alive."""


@dataclass(frozen=True)
class StopMotion:
    """Answered by `Done` when the arm stands."""


@dataclass(frozen=True)
class Done:
    """It is done. Also the child's first message: the controller takes commands."""


@dataclass(frozen=True)
class Progress:
    """How the present motion goes."""

    state: RobotState
    arrived: bool
    program_running: bool
    """Whether the control program still runs in the controller."""


class Inbox:
    """Messages of the other side, read by a thread so that waiting for them has a deadline."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._arrived: queue.SimpleQueue[object] = queue.SimpleQueue()
        self.closed = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True, name="inbox")
        self._thread.start()

    def take(self, timeout_s: float) -> object | None:
        """Return the next message, None where none came in time.

        Raises
        ------
        EOFError
            The other side has gone and everything it said was taken.
        """
        if self.closed.is_set() and self._arrived.empty():
            raise EOFError
        try:
            message = self._arrived.get(timeout=timeout_s)
        except queue.Empty:
            return None
        if message is None:
            raise EOFError
        return message

    def join(self) -> None:
        """Wait for the reading thread after the other side has gone, and close the pipe."""
        self._thread.join()
        self._stream.close()

    def _read(self) -> None:
        try:
            while True:
                self._arrived.put(pickle.load(self._stream))
        except (EOFError, pickle.UnpicklingError):
            # A killed writer may leave half a message behind; it says no more than an end does.
            self._arrived.put(None)
            self.closed.set()


class Outbox:
    """Messages to the other side."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._one_at_a_time = threading.Lock()

    def send(self, message: object) -> None:
        """Send one message.

        Raises
        ------
        BrokenPipeError
            The other side has gone.
        """
        with self._one_at_a_time:
            self._stream.write(pickle.dumps(message))
            self._stream.flush()
