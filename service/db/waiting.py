"""A start waits for a database that another program keeps locked, as the worker does at work."""

import logging
import time
from collections.abc import Callable
from typing import TypeVar

from sqlalchemy.exc import DBAPIError

from service.db.trouble import is_locked

FIRST_PAUSE_S = 0.2
LONGEST_PAUSE_S = 5.0
"""A log that grows fast would fill a full disk further [s]."""

log = logging.getLogger("robocal.database")

Done = TypeVar("Done")


def when_free(act: Callable[[], Done]) -> Done:
    """Do it, and again for as long as the database is locked; other errors pass."""
    pause_s = FIRST_PAUSE_S
    while True:
        try:
            return act()
        except DBAPIError as error:
            if not is_locked(error):
                raise
            log.warning("trying again: another program keeps the database locked (%s)", error.orig)
        time.sleep(pause_s)
        pause_s = min(2.0 * pause_s, LONGEST_PAUSE_S)
