"""A pseudo-terminal that plays a serial port: this side is the instrument, the other the cable."""

from __future__ import annotations

import asyncio
import os
import pty
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LINE_END = b"\n"


class SerialLine:
    """The instrument's end of a serial cable, read line by line."""

    def __init__(self, instrument_end: int) -> None:
        self._fd = instrument_end
        self._lines: asyncio.Queue[bytes] = asyncio.Queue()
        self._pending = b""
        asyncio.get_running_loop().add_reader(instrument_end, self._receive)

    def _receive(self) -> None:
        *lines, self._pending = (self._pending + os.read(self._fd, 4096)).split(LINE_END)
        for line in lines:
            self._lines.put_nowait(line.strip())

    async def next_line(self) -> bytes:
        """Wait for the next line that is not empty, without its end."""
        while not (line := await self._lines.get()):
            pass
        return line

    def send(self, line: bytes) -> None:
        """Send bytes to whoever has the port open."""
        os.write(self._fd, line)

    def close(self) -> None:
        """Stop listening."""
        asyncio.get_running_loop().remove_reader(self._fd)


@contextmanager
def serial_port(link: Path | None) -> Iterator[tuple[int, str]]:
    """Open a pseudo-terminal; give the instrument's end and the name of the port.

    The port's own end stays open here too: without it the instrument's end would report an error
    whenever no program has the port open. `link`, if given, is a symbolic link to the port.
    """
    instrument_end, port_end = pty.openpty()
    tty.setraw(port_end)
    port = os.ttyname(port_end)
    if link is not None:
        link.symlink_to(port)
    try:
        yield instrument_end, port
    finally:
        if link is not None:
            link.unlink()
        os.close(instrument_end)
        os.close(port_end)
