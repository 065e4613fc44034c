"""Keys that were found valid a moment ago: an MES that reads all day is looked up once a second."""

import time
from dataclasses import dataclass, field
from threading import Lock

from service.access.caller import Caller
from service.access.secrets import digest

FRESH_S = 1.0
"""So long a key that another process revoked may still read; changes are always looked up [s]"""
_MOST = 256


@dataclass
class KnownKeys:
    """Callers by the hash of their key."""

    _kept: dict[str, tuple[float, int, Caller]] = field(default_factory=dict)
    _lock: Lock = field(default_factory=Lock)

    def keep(self, key: str, number: int, caller: Caller) -> None:
        """Keep the caller of a key that was just found valid."""
        with self._lock:
            if len(self._kept) >= _MOST:
                self._kept.clear()
            self._kept[digest(key)] = (time.monotonic(), number, caller)

    def find(self, key: str) -> tuple[int, Caller] | None:
        """Return number and caller of a key that was valid a moment ago."""
        found = self._kept.get(digest(key))
        if found is None or time.monotonic() - found[0] > FRESH_S:
            return None
        return found[1], found[2]

    def forget(self) -> None:
        """Look every key up again: one was revoked."""
        with self._lock:
            self._kept.clear()
