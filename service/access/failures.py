"""How often wrong credentials may be tried. Counted in this process; a proxy may count as well."""

import time
from http import HTTPStatus

from limits import RateLimitItem, parse
from limits.storage import MemoryStorage
from limits.strategies import MovingWindowRateLimiter

from service.errors import Problem

PER_ADDRESS = parse("10/5minutes")
PER_NAME = parse("100/hour")


class TooMany(Problem):
    """Credentials were wrong too often; the answer names when to come back."""

    status = HTTPStatus.TOO_MANY_REQUESTS

    def __init__(self, wait_s: int) -> None:
        super().__init__(f"Wrong credentials too often; try again in {wait_s} s.")
        self.headers = {"Retry-After": str(wait_s)}


class Failures:
    """Counts per address and per name."""

    def __init__(self) -> None:
        self._limiter = MovingWindowRateLimiter(MemoryStorage())

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
        self._limiter.clear(PER_ADDRESS, "address", address)
        self._limiter.clear(PER_NAME, "name", name)

    def wrong_key(self, address: str) -> None:
        """Count a wrong key or link; raises `TooMany`. A right one is never kept waiting."""
        self._count(PER_ADDRESS, "key", address)

    def _count(self, limit: RateLimitItem, kind: str, whose: str) -> None:
        if not self._limiter.hit(limit, kind, whose):
            reset = self._limiter.get_window_stats(limit, kind, whose).reset_time
            raise TooMany(max(1, round(reset - time.time())))
