"""Backups: always one SQLite file, whatever the database is, so that either kind can restore it."""

import fcntl
import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

from alembic.util import CommandError
from sqlalchemy.exc import DBAPIError, SQLAlchemyError
from sqlalchemy.orm import Session

from robocal.errors import BadInput
from service.backup.copying import (
    copy_database,
    copy_file,
    copy_still,
    damage_of,
    file_snapshot,
    shown,
    unwritable,
)
from service.backup.rows import CopiedTable, is_empty, summary, tables
from service.db.engine import Database, database_folder, open_database, sqlite_file
from service.db.upgrade import empty_schema, upgrade_schema
from service.jobs.queues import open_queue


def back_up(database: Database, file: Path, lease_s: float) -> list[CopiedTable]:
    """Write what is stored now into a new file; the service and its workers go on.

    Raises
    ------
    BadInput
        If the file is there already or cannot be written, or there is nothing to back up.
    """
    part = _new_part(file)
    try:
        found = _write(database, part, lease_s)
        part.rename(file)
    except DBAPIError as error:
        if isinstance(error.orig, sqlite3.Error):
            raise unwritable(file, error.orig) from None
        raise
    except OSError as error:
        raise unwritable(file, error.strerror) from None
    finally:
        part.unlink(missing_ok=True)
    return found


def restore(
    file: Path, database: Database, lease_s: float, *, replace: bool
) -> tuple[list[CopiedTable], Path | None]:
    """Bring a backup into the database; what it holds is backed up first, and its file named.

    The backup is read to its end before anything is touched. What was there goes beside the
    database's file; for a database without one, beside the backup. A damaged file cannot be backed
    up: it is put aside as it is.

    Raises
    ------
    BadInput
        If the backup cannot be restored, the database holds something and may not be replaced, or
        workers are at work on it.
    """
    with file_snapshot(file) as still, _alone(database):
        damaged = _put_aside(database, lease_s, replace=replace)
        if damaged is not None:
            with _naming(f"the damaged database is in {damaged}; restore again", database):
                upgrade_schema(database)
                return copy_still(still, database, lease_s), damaged
        upgrade_schema(database)
        if not _holds_something(database, lease_s):
            return copy_still(still, database, lease_s), None
        if not replace:
            raise BadInput(
                shown(database), "there is something in this database; say --replace to replace it"
            )
        folder = database_folder(database) or file.absolute().parent
        before = folder / f"before-restore-{_now()}.sqlite3"
        back_up(database, before, lease_s)
        lies = (
            f"what was there before is in {before}, from which "
            f"`robocal restore {before} --replace` brings it back"
        )
        with _naming(lies, database):
            empty_schema(database)
            return copy_still(still, database, lease_s), before


@contextmanager
def _alone(database: Database) -> Iterator[None]:
    """Let a second restore wait for the first, or it would put aside what that has restored."""
    folder = database_folder(database)
    if folder is None:
        yield
        return
    here = os.open(folder, os.O_RDONLY)
    try:
        # A folder on another machine may have no locks.
        with suppress(OSError):
            fcntl.flock(here, fcntl.LOCK_EX)
        yield
    finally:
        os.close(here)


def _put_aside(database: Database, lease_s: float, *, replace: bool) -> Path | None:
    """Rename a damaged SQLite file with what belongs to it; None where the database is whole."""
    present = sqlite_file(database.engine.url.render_as_string(hide_password=False))
    damage = None if present is None else damage_of(present)
    if present is None or damage is None:
        return None
    if not replace:
        raise BadInput(
            str(present),
            f"it is damaged ({damage}); stop the service, then say --replace to put it aside",
        )
    # What is spoilt may still say that somebody works on it.
    with suppress(DBAPIError, ValueError), database.read() as session:
        _refuse_workers(session, database, lease_s)
    database.close()
    present = present.resolve()
    aside = present.with_name(f"damaged-{_now()}.sqlite3")
    try:
        present.rename(aside)
        for suffix in ("-wal", "-shm"):
            log = present.with_name(present.name + suffix)
            if log.exists():
                log.rename(aside.with_name(aside.name + suffix))
    except OSError as error:
        raise unwritable(aside, error.strerror) from None
    return aside


def _now() -> str:
    return datetime.now(UTC).strftime("%Y%m%d-%H%M%S-%f")


def _new_part(file: Path) -> Path:
    """Make the file that becomes the backup when it is whole; raises `BadInput`."""
    part = file.with_name(f"{file.name}.part")
    try:
        if file.exists():
            raise BadInput(str(file), "the file is there already; name a new one")
        part.unlink(missing_ok=True)
        part.touch()
    except OSError as error:
        raise unwritable(file, error.strerror) from None
    return part


def _write(database: Database, part: Path, lease_s: float) -> list[CopiedTable]:
    present = sqlite_file(database.engine.url.render_as_string(hide_password=False))
    if present is not None:
        if not present.is_file():
            raise BadInput(str(present), "there is no database to back up")
        copy_file(present, part)
    kept = open_database(f"sqlite:///{part}")
    try:
        if present is None:
            copy_database(database, kept, lease_s)
        upgrade_schema(kept)
        with kept.read() as session:
            found = [summary(session, table) for table in tables()]
        _leave_write_ahead(kept)
    finally:
        kept.close()
    with part.open("rb+") as written:
        os.fsync(written.fileno())
    return found


def _holds_something(database: Database, lease_s: float) -> bool:
    """Whether there is something to be replaced; raises `BadInput` where workers are at work."""
    with database.read() as session:
        _refuse_workers(session, database, lease_s)
        return not is_empty(session)


def _refuse_workers(session: Session, database: Database, lease_s: float) -> None:
    live = open_queue(database, lease_s).live_workers(session)
    if live:
        raise BadInput(
            shown(database), f"{live} workers are at work on it; stop them before a restore"
        )


@contextmanager
def _naming(lies: str, database: Database) -> Iterator[None]:
    """Let every failure say where that lies which is perhaps no longer in the database."""
    try:
        yield
    except (BadInput, CommandError, SQLAlchemyError, OSError, KeyboardInterrupt) as fault:
        cause = fault.orig if isinstance(fault, DBAPIError) else fault
        raise BadInput(
            shown(database),
            f"the restore was broken off ({str(cause) or 'stopped'}); {lies}",
        ) from fault


def _leave_write_ahead(database: Database) -> None:
    """Put everything into the one file: a backup has no second one beside it."""
    with database.engine.connect() as connection:
        driver = connection.connection.driver_connection
        assert driver is not None
        connection.rollback()
        driver.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        driver.execute("PRAGMA journal_mode = DELETE")
