"""A person's abort, told to the worker by a file beside the database.

A database lets one transaction write at a time, and storing an upload may take it seconds. A robot
that is to stop cannot wait for that: the file is there at once, and the transaction that stores
the wish follows.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import select

from service.campaigns.models import CampaignState
from service.db.engine import Database
from service.db.models import CampaignRow

_NAME = "{database}-stop-{campaign}"


class StopFlag:
    """Up while a person's abort of this campaign is being stored.

    A database that several hosts share has no file beside it: there it is never up.
    """

    def __init__(self, database: Database, campaign: int) -> None:
        self._database = database
        self._campaign = campaign
        file = database.engine.url.database
        name = _NAME.format(database=file, campaign=campaign)
        self._path = name if database.on_one_host else ""

    def is_up(self) -> bool:
        """Whether the robot has to stop; costs microseconds."""
        return bool(self._path) and os.path.exists(self._path)

    @contextmanager
    def up(self) -> Iterator[bool]:
        """Raise it for a campaign that runs, say so, and lower it when the wish is stored."""
        if not self._path or not self._runs():
            yield False
            return
        Path(self._path).touch()
        try:
            yield True
        finally:
            Path(self._path).unlink(missing_ok=True)

    def _runs(self) -> bool:
        with self._database.read() as session:
            state = select(CampaignRow.state).where(CampaignRow.id == self._campaign)
            return session.scalar(state) == CampaignState.running


def lower_all(database: Database) -> None:
    """Take away what a service left that was killed; its worker has seen it long ago."""
    if database.on_one_host and database.engine.url.database:
        file = Path(database.engine.url.database)
        for flag in file.parent.glob(_NAME.format(database=file.name, campaign="*")):
            flag.unlink(missing_ok=True)
