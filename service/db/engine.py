"""One database for service and workers; every change is one short transaction.

SQLite: write-ahead log so that readers never wait, ``synchronous=FULL`` so that an accepted
reading survives a power cut, and ``BEGIN IMMEDIATE`` for writers, because a transaction that
starts as a reader and then writes fails at once when another writer was faster.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from sqlite3 import Connection as SqliteConnection

from sqlalchemy import Connection, Engine, create_engine, event, make_url
from sqlalchemy.orm import Session

BUSY_S = 10.0
"""How long a writer waits for another one [s]."""

_WRITES = "robocal_writes"


@dataclass(frozen=True)
class Database:
    """Where everything is stored."""

    engine: Engine

    @contextmanager
    def read(self) -> Iterator[Session]:
        """One consistent look at the database."""
        with Session(self.engine) as session, session.begin():
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """One transaction that is alone in writing: all of it or nothing."""
        writer = self.engine.execution_options(**{_WRITES: True})
        with Session(writer) as session, session.begin():
            yield session

    def close(self) -> None:
        """Let go of all connections."""
        self.engine.dispose()


def open_database(url: str, busy_s: float = BUSY_S) -> Database:
    """Connect to the database; the schema is brought up by `service.db.upgrade`."""
    engine = create_engine(url)
    if engine.dialect.name == "sqlite":
        path = sqlite_file(url)
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
        event.listen(engine, "connect", partial(_set_pragmas, busy_s))
        event.listen(engine, "begin", _begin)
    return Database(engine)


def sqlite_file(url: str) -> Path | None:
    """Return the file behind an SQLite address; None for another database or one in memory."""
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite" or not parsed.database:
        return None
    return Path(parsed.database)


def _set_pragmas(busy_s: float, connection: SqliteConnection, record: object) -> None:
    # Python's sqlite3 module must not begin transactions by itself.
    connection.isolation_level = None
    connection.execute(f"PRAGMA busy_timeout = {round(busy_s * 1e3)}")
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute("PRAGMA foreign_keys = ON")


def _begin(connection: Connection) -> None:
    writes = connection.get_execution_options().get(_WRITES, False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")
