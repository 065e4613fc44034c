"""Waiting for a computation that somebody at a page or a program asked for."""

import time
from dataclasses import dataclass

from service.procedures.computation import NumericsFailed

PATIENCE_S = 120.0
"""Longest computation that a request waits for."""


@dataclass(frozen=True)
class Patience:
    """Waits for a computation until a deadline."""

    until_s: float

    def wait(self, seconds: float) -> None:
        """Let time pass; raises `NumericsFailed` past the deadline."""
        if time.monotonic() > self.until_s:
            raise NumericsFailed(f"The computation took longer than {PATIENCE_S:g} s.")
        time.sleep(seconds)


def patience() -> Patience:
    """Start to wait now."""
    return Patience(time.monotonic() + PATIENCE_S)
