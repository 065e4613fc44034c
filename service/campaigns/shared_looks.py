"""One look into the database for all pages that watch a campaign: fifty pages cost as one."""

import time
from collections import OrderedDict
from dataclasses import dataclass, field

import anyio
import anyio.to_thread

from service.campaigns.events import Look, look
from service.db.engine import Database

_KEPT = 256


@dataclass
class _Kept:
    """The latest look after one revision; the lock lets one page look and the others wait."""

    lock: anyio.Lock = field(default_factory=anyio.Lock)
    seen: Look | None = None
    at: float = 0.0


class SharedLooks:
    """Looks of one application; used in its event loop alone."""

    def __init__(self, database: Database, fresh_s: float) -> None:
        self._database = database
        self._fresh_s = fresh_s
        self._kept: OrderedDict[tuple[int, int], _Kept] = OrderedDict()

    async def after(self, number: int, since: int) -> Look:
        """Everything after revision `since`, as it was at most `fresh_s` ago."""
        kept = self._kept.setdefault((number, since), _Kept())
        self._kept.move_to_end((number, since))
        while len(self._kept) > _KEPT:
            self._kept.popitem(last=False)
        async with kept.lock:
            if kept.seen is None or time.monotonic() - kept.at >= self._fresh_s:
                kept.seen = await anyio.to_thread.run_sync(look, self._database, number, since)
                kept.at = time.monotonic()
            return kept.seen
