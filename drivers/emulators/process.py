"""What every emulator process does the same way: one ready line, and an end with its parent.

An emulator prints one line of JSON with its addresses when it can be talked to, and ends when its
standard input closes, so that none outlives the program that started it. Lines that arrive on
standard input before that are commands to the emulator (fault switches).
"""

import asyncio
import json
import os
import sys
import threading
from collections.abc import Callable

STDIN = 0


def report_ready(**addresses: str | int) -> None:
    """Print the one line that says where this emulator listens."""
    sys.stdout.write(json.dumps({"ready": True, **addresses}) + "\n")
    sys.stdout.flush()


async def until_stdin_closes(on_line: Callable[[str], None] | None = None) -> None:
    """Return when standard input reaches its end; hand each line before that to `on_line`.

    A thread with plain `os.read` is used because an event loop cannot watch every kind of
    standard input on every system, and because a buffered reader would hold its lock at exit.
    """
    loop = asyncio.get_running_loop()
    closed = asyncio.Event()

    def watch() -> None:
        pending = b""
        while chunk := os.read(STDIN, 4096):
            *lines, pending = (pending + chunk).split(b"\n")
            for line in lines:
                if on_line is not None:
                    loop.call_soon_threadsafe(on_line, line.decode())
        loop.call_soon_threadsafe(closed.set)

    threading.Thread(target=watch, daemon=True, name="stdin").start()
    await closed.wait()
