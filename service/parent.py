"""A process that was started for another one ends with it, however that one ended."""

import os
import signal
import sys
import threading

WITH_PARENT = "--with-parent"
"""Argument of a program whose standard input is held open by the one that started it."""


def end_with_parent() -> None:
    """If so asked on the command line, end as by SIGTERM when standard input closes."""
    if WITH_PARENT in sys.argv[1:]:
        threading.Thread(target=_await_end, daemon=True, name="parent").start()


def _await_end() -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
