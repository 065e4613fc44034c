"""A pseudo-terminal that can be unplugged and plugged in again, and that minds the line's speed."""

from __future__ import annotations

import asyncio
import os
import pty
import termios
import tty
from collections.abc import Callable
from pathlib import Path

SPEED = 5
"""Place of the output speed in what `tcgetattr` returns, the input speed's before it."""


class SerialPlug:
    """The instrument's end of a serial cable.

    Parameters
    ----------
    baud
        Speed that is set at the instrument.
    link
        Symbolic link to the port; needed for plugging in again under the same name.
    on_bytes
        Called with the bytes that come in at the right speed.
    on_wrong_speed
        Called when bytes come in at another speed.
    """

    def __init__(
        self,
        baud: int,
        link: Path | None,
        on_bytes: Callable[[bytes], None],
        on_wrong_speed: Callable[[], None],
    ) -> None:
        self._speed = getattr(termios, f"B{baud}")
        self._link = link
        self._on_bytes = on_bytes
        self._on_wrong_speed = on_wrong_speed
        self._ends: tuple[int, int] | None = None
        self._spoken = self._speed
        self.port = ""

    def mistune(self, *, wrong: bool) -> None:
        """Set the instrument to another speed than before, or back to its own."""
        other = termios.B1200 if self._speed != termios.B1200 else termios.B2400
        self._spoken = other if wrong else self._speed

    def plug(self) -> None:
        """Make a port.

        Its own end stays open here too: without it the instrument's end would report an error
        whenever no program has the port open.
        """
        if self._ends is not None:
            return
        instrument_end, port_end = pty.openpty()
        tty.setraw(port_end)
        attributes = termios.tcgetattr(port_end)
        attributes[SPEED - 1] = attributes[SPEED] = self._speed
        termios.tcsetattr(port_end, termios.TCSANOW, attributes)
        self.port = os.ttyname(port_end)
        if self._link is not None:
            self._link.symlink_to(self.port)
            self.port = str(self._link)
        self._ends = instrument_end, port_end
        asyncio.get_running_loop().add_reader(instrument_end, self._receive)

    def unplug(self) -> None:
        """Pull the cable: whoever has the port open gets an error."""
        if self._ends is None:
            return
        asyncio.get_running_loop().remove_reader(self._ends[0])
        for end in self._ends:
            os.close(end)
        self._ends = None
        if self._link is not None:
            self._link.unlink()

    def send(self, line: bytes) -> None:
        """Send bytes to whoever has the port open; without a cable they are lost."""
        if self._ends is not None and line:
            os.write(self._ends[0], line)

    def _receive(self) -> None:
        assert self._ends is not None
        received = os.read(self._ends[0], 4096)
        if termios.tcgetattr(self._ends[0])[SPEED] == self._spoken:
            self._on_bytes(received)
        else:
            self._on_wrong_speed()
