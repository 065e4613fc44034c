"""When keys were last used: kept in memory, and written now and then.

A write for every read would make the MES wait for the campaign's transactions.
"""

import logging
from threading import Lock

from sqlalchemy.exc import DBAPIError

from service.access import keys
from service.background import Background
from service.clock import utc_now
from service.db.engine import Database

WRITE_EVERY_S = 30.0

log = logging.getLogger("robocal.access")


class LastUsed(Background):
    """Context manager: writes in a thread of its own, and once more at its end."""

    def __init__(self, database: Database) -> None:
        super().__init__("last-used")
        self._database = database
        self._moments: dict[int, str] = {}
        self._lock = Lock()

    def note(self, number: int) -> None:
        """A key was used now."""
        with self._lock:
            self._moments[number] = utc_now()

    def _run(self) -> None:
        while not self._over.wait(WRITE_EVERY_S):
            self._write()
        self._write()

    def _write(self) -> None:
        with self._lock:
            moments, self._moments = self._moments, {}
        if not moments:
            return
        try:
            with self._database.write() as session:
                keys.used(session, moments)
        except DBAPIError as error:
            log.warning("the last use of %d keys was not kept: %s", len(moments), error.orig)
