"""Backups: always one SQLite file, whatever the database is, so that either kind can restore it."""

import os
from datetime import UTC, datetime
from pathlib import Path

from robocal.errors import BadInput
from service.backup.copying import copy_database, copy_file, shown
from service.backup.rows import CopiedTable, is_empty, summary, tables
from service.db.engine import Database, open_database, sqlite_file
from service.db.upgrade import empty_schema, upgrade_schema
from service.jobs.queues import open_queue


def back_up(database: Database, file: Path, lease_s: float) -> list[CopiedTable]:
    """Write what is stored now into a new file; the service and its workers go on.

    Raises
    ------
    BadInput
        If the file is there already, or there is nothing to back up.
    """
    if file.exists():
        raise BadInput(str(file), "the file is there already; name a new one")
    part = file.with_name(f"{file.name}.part")
    part.unlink(missing_ok=True)
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
    part.rename(file)
    return found


def restore(
    file: Path, database: Database, lease_s: float, *, replace: bool
) -> tuple[list[CopiedTable], Path | None]:
    """Bring a backup into the database; what it holds is backed up first, and its file named.

    Raises
    ------
    BadInput
        If the database holds something and may not be replaced, or workers are at work on it.
    """
    upgrade_schema(database)
    with database.read() as session:
        holds_something = not is_empty(session)
        live = open_queue(database, lease_s).live_workers(session)
    if live:
        raise BadInput(
            shown(database), f"{live} workers are at work on it; stop them before a restore"
        )
    before = None
    if holds_something:
        if not replace:
            raise BadInput(
                shown(database), "there is something in this database; say --replace to replace it"
            )
        now = datetime.now(UTC).strftime("%Y%m%d-%H%M%S-%f")
        before = file.with_name(f"before-restore-{now}.sqlite3")
        back_up(database, before, lease_s)
        empty_schema(database)
    source = open_database(f"sqlite:///{file}")
    try:
        return copy_database(source, database, lease_s), before
    finally:
        source.close()


def _leave_write_ahead(database: Database) -> None:
    """Put everything into the one file: a backup has no second one beside it."""
    with database.engine.connect() as connection:
        driver = connection.connection.driver_connection
        assert driver is not None
        connection.rollback()
        driver.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        driver.execute("PRAGMA journal_mode = DELETE")
