"""When keys were last used: kept in memory, and written now and then.

A write for every read would make the MES wait for the campaign's transactions.
"""

import logging
from threading import Event, Lock, Thread
from types import TracebackType
from typing import Self

from sqlalchemy.exc import OperationalError

from service.access import keys
from service.clock import utc_now
from service.db.engine import Database

WRITE_EVERY_S = 30.0

log = logging.getLogger("robocal.access")


class LastUsed:
    """Context manager: writes in a thread of its own, and once more at its end."""

    def __init__(self, database: Database) -> None:
        self._database = database
        self._moments: dict[int, str] = {}
        self._lock = Lock()
        self._ending = Event()
        self._thread = Thread(target=self._run, name="last-used", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._ending.set()
        self._thread.join()
        self._write()

    def note(self, number: int) -> None:
        """A key was used now."""
        with self._lock:
            self._moments[number] = utc_now()

    def _run(self) -> None:
        while not self._ending.wait(WRITE_EVERY_S):
            self._write()

    def _write(self) -> None:
        with self._lock:
            moments, self._moments = self._moments, {}
        if not moments:
            return
        try:
            with self._database.write() as session:
                keys.used(session, moments)
        except OperationalError as error:
            log.warning("the last use of %d keys was not kept: %s", len(moments), error.orig)
