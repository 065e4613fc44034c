"""How often wrong credentials may be tried. Counted in this process; a proxy may count as well."""

import math
import time
from collections import deque
from dataclasses import dataclass
from http import HTTPStatus
from threading import Lock

from service.errors import Problem


@dataclass(frozen=True)
class Limit:
    """So many tries within any span of time."""

    most: int
    span_s: float


PER_ADDRESS = Limit(10, 300.0)
PER_NAME = Limit(100, 3600.0)
_LONGEST_S = max(PER_ADDRESS.span_s, PER_NAME.span_s)
_CROWD = 1000
"""Counts that are kept at least before old ones are looked for."""


class TooMany(Problem):
    """Credentials were wrong too often; the answer names when to come back."""

    status = HTTPStatus.TOO_MANY_REQUESTS

    def __init__(self, wait_s: int) -> None:
        super().__init__(f"Wrong credentials too often; try again in {wait_s} s.")
        self.headers = {"Retry-After": str(wait_s)}


class Failures:
    """Counts per address and per name.

    On the host's monotonic clock: were the other one set back by a day, whoever was locked out
    would wait for a day.
    """

    def __init__(self) -> None:
        self._tries: dict[tuple[str, str], deque[float]] = {}
        self._crowd = _CROWD
        self._lock = Lock()

    def attempt(self, address: str, name: str) -> None:
        """Count a password before it is looked at, so that many at once do not slip through.

        Raises
        ------
        TooMany
            If there were too many before.
        """
        self._count(PER_ADDRESS, "address", address)
        self._count(PER_NAME, "name", name)

    def succeeded(self, address: str, name: str) -> None:
        """Forget the attempts of somebody who knew the password."""
        with self._lock:
            self._tries.pop(("address", address), None)
            self._tries.pop(("name", name), None)

    def wrong_key(self, address: str) -> None:
        """Count a wrong key or link; raises `TooMany`. A right one is never kept waiting."""
        self._count(PER_ADDRESS, "key", address)

    def _count(self, limit: Limit, kind: str, whose: str) -> None:
        with self._lock:
            now = time.monotonic()
            self._tidy(now)
            tries = self._tries.setdefault((kind, whose), deque())
            while tries and now - tries[0] >= limit.span_s:
                tries.popleft()
            if len(tries) >= limit.most:
                raise TooMany(math.ceil(tries[0] + limit.span_s - now))
            tries.append(now)

    def _tidy(self, now: float) -> None:
        """Let go of old counts when there are twice as many as last time."""
        if len(self._tries) < self._crowd:
            return
        recent = {
            whose: tries for whose, tries in self._tries.items() if now - tries[-1] < _LONGEST_S
        }
        self._tries = recent
        self._crowd = max(_CROWD, 2 * len(recent))
