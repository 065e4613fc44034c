"""One database for service and workers; every change is one short transaction.

SQLite: write-ahead log so that readers never wait, ``synchronous=FULL`` so that an accepted
reading survives a power cut, and ``BEGIN IMMEDIATE`` for writers, because a transaction that
starts as a reader and then writes fails at once when another writer was faster.

PostgreSQL promises the same: readers see one snapshot, and writers take one advisory lock, so
that what a writer has read stays true until it commits. A host that vanished or froze in the
middle of a transaction is thrown out by the server, which frees the lock.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from sqlite3 import SQLITE_BUSY
from sqlite3 import Connection as SqliteConnection
from sqlite3 import OperationalError as SqliteError

from sqlalchemy import Connection, Engine, create_engine, event, make_url
from sqlalchemy.exc import ArgumentError
from sqlalchemy.orm import Session

BUSY_S = 10.0
"""How long a writer waits for another one [s]."""

QUEUE_SCHEMA = "procrastinate"
"""Where PostgreSQL keeps the job queue's own tables."""

_WRITES = "robocal_writes"
_WRITERS_LOCK = 0x0B0CA1
"""Number of the advisory lock that writers take."""
_CONNECT_S = 10
_SWITCH_AGAIN_S = 0.01


@dataclass(frozen=True)
class Database:
    """Where everything is stored."""

    engine: Engine

    @contextmanager
    def read(self) -> Iterator[Session]:
        """One consistent look at the database."""
        reader = self.engine
        if not self.on_one_host:
            reader = reader.execution_options(
                isolation_level="REPEATABLE READ", postgresql_readonly=True
            )
        with Session(reader) as session, session.begin():
            yield session

    @contextmanager
    def write(self) -> Iterator[Session]:
        """One transaction that is alone in writing: all of it or nothing."""
        writer = self.engine.execution_options(**{_WRITES: True})
        with Session(writer) as session, session.begin():
            yield session

    @property
    def on_one_host(self) -> bool:
        """Whether it is a file, which several hosts cannot share."""
        return self.engine.dialect.name == "sqlite"

    def close(self) -> None:
        """Let go of all connections."""
        self.engine.dispose()


def open_database(url: str, busy_s: float = BUSY_S) -> Database:
    """Connect to the database; the schema is brought up by `service.db.upgrade`.

    Raises
    ------
    sqlalchemy.exc.ArgumentError
        If the address is of a database that is not known here.
    """
    backend = make_url(url).get_backend_name()
    if backend not in _OPENERS:
        raise ArgumentError(f"robocal does not work on {backend}")
    return Database(_OPENERS[backend](url, busy_s))


def _open_sqlite(url: str, busy_s: float) -> Engine:
    engine = create_engine(url, hide_parameters=True)
    path = sqlite_file(url)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
    event.listen(engine, "connect", partial(_set_pragmas, busy_s))
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def _open_postgresql(url: str, busy_s: float) -> Engine:
    busy_ms = round(busy_s * 1e3)
    options = {
        "search_path": f"public,{QUEUE_SCHEMA}",
        "lock_timeout": busy_ms,
        "idle_in_transaction_session_timeout": max(busy_ms, round(BUSY_S * 1e3)),
        "timezone": "UTC",
    }
    engine = create_engine(
        make_url(url).set(drivername="postgresql+psycopg"),
        pool_pre_ping=True,
        hide_parameters=True,
        connect_args={
            "connect_timeout": _CONNECT_S,
            "options": " ".join(f"-c {name}={value}" for name, value in options.items()),
        },
    )
    event.listen(engine, "begin", _begin_postgresql)
    return engine


_OPENERS = {"sqlite": _open_sqlite, "postgresql": _open_postgresql}


def sqlite_file(url: str) -> Path | None:
    """Return the file behind an SQLite address; None for another database or one in memory."""
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite" or not parsed.database:
        return None
    return Path(parsed.database)


def database_folder(database: Database) -> Path | None:
    """Return the folder of an SQLite file; None for another database or one in memory."""
    file = sqlite_file(database.engine.url.render_as_string(hide_password=False))
    return None if file is None else file.absolute().parent


def _set_pragmas(busy_s: float, connection: SqliteConnection, record: object) -> None:
    # Python's sqlite3 module must not begin transactions by itself.
    connection.isolation_level = None
    connection.execute(f"PRAGMA busy_timeout = {round(busy_s * 1e3)}")
    _use_write_ahead_log(connection, busy_s)
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute("PRAGMA foreign_keys = ON")


def _use_write_ahead_log(connection: SqliteConnection, busy_s: float) -> None:
    """Switch a new file over; where another process writes it just then, SQLite does not wait."""
    until = time.monotonic() + busy_s
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
        except SqliteError as error:
            if error.sqlite_errorcode != SQLITE_BUSY or time.monotonic() >= until:
                raise
            time.sleep(_SWITCH_AGAIN_S)
        else:
            return


def _begin_sqlite(connection: Connection) -> None:
    connection.exec_driver_sql("BEGIN IMMEDIATE" if _writes(connection) else "BEGIN")


def _begin_postgresql(connection: Connection) -> None:
    if _writes(connection):
        connection.exec_driver_sql(f"SELECT pg_advisory_xact_lock({_WRITERS_LOCK})")


def _writes(connection: Connection) -> bool:
    return bool(connection.get_execution_options().get(_WRITES, False))
