"""What is wrong with the database, in one sentence that says what to do about it."""

import sqlite3
from enum import StrEnum

import psycopg
from sqlalchemy.exc import DBAPIError


class Trouble(StrEnum):
    """Kinds of trouble; the value is the sentence."""

    disk_full = (
        "The disk that holds the database is full and nothing was stored; "
        "make room on it, then send the request again."
    )
    disk_broken = (
        "The disk that holds the database refuses to be written and nothing was stored; "
        "look after the disk, the service's log has the details."
    )
    damaged = (
        "The database is damaged and nothing was stored; stop the service and bring the last "
        "backup back with 'robocal restore FILE --replace'."
    )
    read_only = "The database may be read but not written; give the service the right to write it."
    unsuitable = "The database cannot hold a value of the request; use a smaller or plainer one."
    busy = "The database does not answer at this moment; send the request again."


_SQLITE = {
    sqlite3.SQLITE_FULL: Trouble.disk_full,
    sqlite3.SQLITE_IOERR: Trouble.disk_broken,
    sqlite3.SQLITE_READONLY: Trouble.read_only,
    sqlite3.SQLITE_CANTOPEN: Trouble.disk_broken,
    sqlite3.SQLITE_CORRUPT: Trouble.damaged,
    sqlite3.SQLITE_NOTADB: Trouble.damaged,
}
_PRIMARY_CODE = 0xFF
_LOCKED = (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)

_POSTGRESQL = (
    (psycopg.errors.DiskFull, Trouble.disk_full),
    (psycopg.errors.IoError, Trouble.disk_broken),
    (psycopg.errors.ReadOnlySqlTransaction, Trouble.read_only),
    (psycopg.DataError, Trouble.unsuitable),
)


def trouble_of(error: DBAPIError) -> Trouble:
    """Say what the trouble is; what neither the disk nor the request caused passes by itself."""
    cause = error.orig
    if isinstance(cause, sqlite3.Error):
        # The code is missing where Python's own module found the fault.
        code = getattr(cause, "sqlite_errorcode", sqlite3.SQLITE_BUSY)
        return _SQLITE.get(code & _PRIMARY_CODE, Trouble.busy)
    for kind, trouble in _POSTGRESQL:
        if isinstance(cause, kind):
            return trouble
    return Trouble.busy


def is_damaged(error: BaseException) -> bool:
    """Whether the database itself is spoilt; SQLAlchemy has no class of its own for that."""
    return isinstance(error, DBAPIError) and trouble_of(error) is Trouble.damaged


def is_locked(error: DBAPIError) -> bool:
    """Whether another program held the database too long: it will let go of it."""
    cause = error.orig
    if isinstance(cause, sqlite3.Error):
        return getattr(cause, "sqlite_errorcode", 0) & _PRIMARY_CODE in _LOCKED
    return isinstance(cause, psycopg.errors.LockNotAvailable)
