"""From one database to another: SQLite to PostgreSQL when one host is outgrown, or back again."""

import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from alembic.util import CommandError
from sqlalchemy import text, update
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from robocal.errors import BadInput
from service.backup.rows import CopiedTable, copy_rows, is_empty, summary, tables
from service.db.engine import Database, open_database, sqlite_file
from service.db.models import CellRow, JobRow
from service.db.upgrade import is_up_to_date, schema_revision, upgrade_schema
from service.jobs.procrastinate_queue import ProcrastinateQueue

_OF_THE_COPY = (
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_IOERR_WRITE,
    sqlite3.SQLITE_IOERR_FSYNC,
)
"""What goes wrong where is written, and not where is read."""


_OUT_OF_REACH = (
    sqlite3.SQLITE_BUSY,
    sqlite3.SQLITE_LOCKED,
    sqlite3.SQLITE_CANTOPEN,
    sqlite3.SQLITE_PERM,
    sqlite3.SQLITE_FULL,
    sqlite3.SQLITE_READONLY,
    sqlite3.SQLITE_IOERR,
)


class Unreadable(BadInput):
    """What is in the file is spoilt."""


def copy_database(source: Database, target: Database, lease_s: float) -> list[CopiedTable]:
    """Copy everything into an empty database, in which no cell is armed.

    The source may be in use: what was stored until now is copied, and no half of a transaction.

    Raises
    ------
    BadInput
        If the target holds something, or a database is of another version of robocal.
    """
    upgrade_schema(target)
    with snapshot(source) as still:
        return copy_still(still, target, lease_s)


def copy_still(still: Database, target: Database, lease_s: float) -> list[CopiedTable]:
    """Copy a database that nobody changes into an empty one, in which no cell is armed.

    Both are of this version of robocal.

    Raises
    ------
    BadInput
        If the target holds something.
    """
    with still.read() as sent, target.write() as received:
        if not is_empty(received):
            raise BadInput(
                shown(target), "there is something in this database; copy into an empty one"
            )
        copied = copy_rows(sent, received)
        # An operator allowed motion after a look into the cell, not for whenever the copy starts.
        received.execute(update(CellRow).values(armed=False))
        _free_jobs(received, target, lease_s)
    return copied


@contextmanager
def snapshot(database: Database) -> Iterator[Database]:
    """Return a database that can be read as it is now, of this version of robocal."""
    file = sqlite_file(database.engine.url.render_as_string(hide_password=False))
    if file is None:
        if not is_up_to_date(database):
            raise BadInput(
                shown(database),
                "it is of another version of robocal; start this version's service on it once",
            )
        yield database
        return
    with file_snapshot(file) as still:
        yield still


@contextmanager
def file_snapshot(file: Path) -> Iterator[Database]:
    """Return a copy of an SQLite file that was read to its end, of this version of robocal.

    Raises
    ------
    BadInput
        If the file is not whole, or holds no database that this version can bring up.
    """
    if not file.is_file():
        raise BadInput(str(file), "there is no such file")
    with tempfile.TemporaryDirectory(prefix="robocal-") as folder:
        copy = Path(folder) / "snapshot.sqlite3"
        copy_file(file, copy)
        opened = open_database(f"sqlite:///{copy}")
        try:
            _bring_up(opened, file)
            yield opened
        finally:
            opened.close()


def copy_file(file: Path, copy: Path) -> None:
    """Copy an SQLite file that may be in use.

    Raises
    ------
    BadInput
        If the file is damaged, or the copy cannot be written.
    """
    try:
        with closing(sqlite3.connect(file)) as source, closing(sqlite3.connect(copy)) as target:
            source.backup(target)
            verdict = target.execute("PRAGMA integrity_check").fetchone()[0]
    except UnicodeDecodeError as fault:
        raise Unreadable(str(file), f"the database is damaged ({fault})") from None
    except sqlite3.DatabaseError as fault:
        # The code is missing where Python's own module found the fault.
        if getattr(fault, "sqlite_errorcode", None) in _OF_THE_COPY:
            raise unwritable(copy, fault) from None
        raise Unreadable(str(file), f"it cannot be read as a database ({fault})") from None
    if verdict != "ok":
        raise Unreadable(str(file), f"the database is damaged ({verdict}); take an older copy")


def damage_of(file: Path) -> str | None:
    """What is wrong with an SQLite file of robocal; None where it is whole, or not there."""
    if not file.is_file() or file.stat().st_size == 0:
        return None
    try:
        with closing(sqlite3.connect(file)) as opened:
            opened.execute("SELECT 1 FROM sqlite_master").fetchall()
    except sqlite3.OperationalError as fault:
        # Locked, or out of reach: that says nothing about what is in it.
        code = getattr(fault, "sqlite_errorcode", sqlite3.SQLITE_BUSY)
        return None if code & 0xFF in _OUT_OF_REACH else str(fault)
    except (sqlite3.DatabaseError, UnicodeDecodeError) as fault:
        return str(fault)
    try:
        with file_snapshot(file):
            return None
    except Unreadable as damage:
        return damage.reason.partition(";")[0]
    except BadInput:
        return None


def unwritable(file: Path, cause: object) -> BadInput:
    """Return what to say of a new file that could not be written."""
    return BadInput(
        str(file), f"it cannot be written ({cause}); make its folder or room, or name another place"
    )


def shown(database: Database) -> str:
    """Address of a database, without its password."""
    return database.engine.url.render_as_string(hide_password=True)


def _bring_up(copy: Database, file: Path) -> None:
    """Bring a file's copy to this version and read every row; raises `BadInput` for the file."""
    try:
        if schema_revision(copy.engine) is None:
            raise BadInput(str(file), "it holds no database of robocal; name another file")
        upgrade_schema(copy)
        with copy.read() as session:
            for table in tables():
                summary(session, table)
            orphan = session.execute(text("PRAGMA foreign_key_check")).first()
    except CommandError as fault:
        raise BadInput(
            str(file), f"it is of another version of robocal ({fault}); use that version"
        ) from None
    except (SQLAlchemyError, ValueError) as fault:
        raise Unreadable(
            str(file), f"not all of it can be read ({fault}); take an older copy"
        ) from None
    if orphan is not None:
        raise Unreadable(
            str(file),
            f"the database is damaged (row {orphan[1]} of table '{orphan[0]}' misses one of "
            f"table '{orphan[2]}'); take an older copy",
        )


def _free_jobs(session: Session, target: Database, lease_s: float) -> None:
    """Take open jobs out of the hands of the source's workers, who know nothing of the copy."""
    session.execute(
        update(JobRow)
        .where(JobRow.state == "running")
        .values(state="queued", worker="", lease_until=0.0, fence=JobRow.fence + 1)
    )
    session.execute(update(JobRow).values(delivery=None))
    session.expire_all()
    if not target.on_one_host:
        ProcrastinateQueue(target, lease_s).send_open_jobs(session)
