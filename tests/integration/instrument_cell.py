"""A world and one serial instrument as processes, for the tests of instruments' drivers."""

import json
import os
import select
import termios
import tty
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from geocom_cell import POST, WORLD, Cell, Emulator

TRANSCRIPTS = Path(__file__).parents[1] / "drivers" / "transcripts"


@contextmanager
def instrument_cell(
    folder: Path, module: str, *arguments: str, robot: str = POST, **config: Any
) -> Iterator[Cell]:
    """Run a world and an instrument whose port is the link `folder`/port."""
    (folder / "post.yaml").write_text(robot)
    path = folder / "world.json"
    path.write_text(json.dumps({**WORLD, **config}))
    with ExitStack() as running:
        world = Emulator("world", "--config", str(path))
        running.callback(world.end)
        address = f"127.0.0.1:{world.port}"
        link = str(folder / "port")
        instrument = Emulator(module, "--world", address, "--link", link, *arguments)
        running.callback(instrument.end)
        cell = Cell(folder, world, instrument)
        running.callback(cell.close)
        yield cell


def exchange_bytes(port: str, baud: int, request: bytes, count: int) -> bytes:
    """Send bytes to a port and take as many as are expected, and those that should not be there."""
    line = os.open(port, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(line)
        attributes = termios.tcgetattr(line)
        attributes[4] = attributes[5] = getattr(termios, f"B{baud}")
        termios.tcsetattr(line, termios.TCSANOW, attributes)
        os.write(line, request)
        received = b""
        while select.select([line], [], [], 5.0 if len(received) < count else 0.02)[0]:
            received += os.read(line, 4096)
        return received
    finally:
        os.close(line)
