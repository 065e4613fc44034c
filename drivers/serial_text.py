"""Text lines over a serial port, for instruments whose replies carry no number.

Such a reply cannot be told from a late one to an earlier request. So after anything went wrong
the line must have been silent for twice as long as a reply may take before the next request goes
out; and before every request what lies about in the buffer is thrown away.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from serial import Serial

from drivers.errors import BadReply, NoReply, Unreachable
from drivers.transport import EIGHT_BITS, LATE_REPLIES, open_serial, wait_for_silence

LINE_END = b"\r\n"
LONGEST_LINE = 1000
"""[bytes]"""


class SerialText:
    """A serial port that speaks lines of text, opened again after it was unplugged.

    Parameters
    ----------
    device
        Name and address, for error messages.
    port
        Name of the serial port.
    baud, frame
        Speed and form as set at the instrument.
    timeout_s
        Longest time that the instrument takes for a reply [s].
    """

    def __init__(
        self, device: str, port: str, baud: int, timeout_s: float, frame: str = EIGHT_BITS
    ) -> None:
        self._device = device
        self._name = port
        self._baud = baud
        self._frame = frame
        self._timeout_s = timeout_s
        self._port: Serial | None = None
        self._wanted = False
        self._doubtful = False

    def open(self) -> None:
        """Open the port."""
        self._wanted = True
        self._opened("connect")

    def close(self) -> None:
        """Close the port if open."""
        self._wanted = False
        self._drop()

    def ask(self, command: str, request: bytes, pattern: re.Pattern[bytes]) -> re.Match[bytes]:
        """Send a request line and return the line that comes back, matched whole.

        Raises
        ------
        Unreachable
            If the port does not open or was unplugged.
        NoReply
            If nothing comes.
        BadReply
            If something else comes than `pattern` allows, or half of it.
        """
        with self._use(command) as port:
            self.forget(command)
            port.write(request + LINE_END)
            return self._receive(command, port, pattern)

    def listen(self, command: str, pattern: re.Pattern[bytes]) -> re.Match[bytes]:
        """Return the next line that is sent by itself; raises like `ask`."""
        with self._use(command) as port:
            return self._receive(command, port, pattern)

    def skip_line(self, command: str) -> None:
        """Pass over everything up to the next line end: it may have begun before."""
        with self._use(command) as port:
            self._line(command, port)

    def forget(self, command: str) -> None:
        """Throw away what was received until now, and after a failure wait for silence."""
        with self._use(command) as port:
            if self._doubtful:
                self._wait_for_silence(command, port)
            port.read(port.in_waiting)

    def forget_stream(self, command: str) -> None:
        """Throw away what was received until now, on a line that is never silent by nature."""
        with self._use(command) as port:
            port.read(port.in_waiting)
            self._doubtful = False

    def doubt(self) -> None:
        """Say that the last line was not what it should be."""
        self._doubtful = True

    def _receive(self, command: str, port: Serial, pattern: re.Pattern[bytes]) -> re.Match[bytes]:
        line = self._line(command, port)
        found = pattern.fullmatch(line)
        if found is None:
            self._doubtful = True
            raise BadReply(self._device, command, f"the reply is garbled; {self._advice()}", line)
        return found

    def _line(self, command: str, port: Serial) -> bytes:
        line = port.read_until(b"\n", LONGEST_LINE)
        if line.endswith(b"\n"):
            return line.strip()
        self._doubtful = True
        if line:
            raise BadReply(self._device, command, f"the reply is cut off; {self._advice()}", line)
        raise NoReply(
            self._device,
            command,
            f"no reply within {self._timeout_s:g} s; check that it is switched on, and "
            + self._advice(),
        )

    def _advice(self) -> str:
        return f"check the cable and that the instrument is set to {self._baud} baud {self._frame}"

    def _wait_for_silence(self, command: str, port: Serial) -> None:
        noise = wait_for_silence(port, LATE_REPLIES * self._timeout_s)
        if noise:
            raise BadReply(
                self._device, command, f"the line is never silent; {self._advice()}", noise
            )
        self._doubtful = False

    @contextmanager
    def _use(self, command: str) -> Iterator[Serial]:
        port = self._opened(command)
        try:
            yield port
        except OSError as fault:
            self._drop()
            raise Unreachable(
                self._device,
                command,
                f"serial port {self._name} is gone ({fault}); plug it in again and check the cable",
            ) from fault

    def _opened(self, command: str) -> Serial:
        if not self._wanted:
            raise Unreachable(self._device, command, "not connected; call connect first")
        if self._port is None:
            self._port = open_serial(
                self._device, self._name, self._baud, self._timeout_s, self._frame
            )
            self._doubtful = False
        return self._port

    def _drop(self) -> None:
        if self._port is not None:
            self._port.close()
            self._port = None
