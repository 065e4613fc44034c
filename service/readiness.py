"""Whether the service can do its work: it is tried, not believed."""

import shutil
from pathlib import Path

from pydantic import BaseModel
from sqlalchemy.exc import DBAPIError

from service.clock import utc_now
from service.db.engine import Database, database_folder
from service.db.models import ProbeRow
from service.db.trouble import trouble_of
from service.jobs.queue import JobQueue
from service.settings import Settings


class Check(BaseModel):
    """One thing that the service needs."""

    name: str
    passed: bool
    detail: str


def checks(database: Database, queue: JobQueue, settings: Settings) -> list[Check]:
    """Try everything; what depends on the database only where there is one."""
    found = [_disk(database, settings.disk_free_min_mb), _database(database)]
    if found[-1].passed:
        found.append(_worker(database, queue, settings.lease_s))
    return found


def free_mb(folder: Path) -> float:
    """Free space on the disk of a folder [MB]."""
    return shutil.disk_usage(folder).free / 1e6


def _database(database: Database) -> Check:
    try:
        with database.write() as session:
            session.merge(ProbeRow(id=1, written=utc_now()))
    except DBAPIError as error:
        return Check(name="database", passed=False, detail=f"{trouble_of(error)} ({error.orig})")
    return Check(name="database", passed=True, detail="was written")


def _worker(database: Database, queue: JobQueue, lease_s: float) -> Check:
    with database.read() as session:
        live = queue.live_workers(session)
    detail = f"{live} heard of within {lease_s:g} s"
    if live == 0:
        detail += "; start one: python -m service.jobs.worker"
    return Check(name="worker", passed=live > 0, detail=detail)


def _disk(database: Database, least_mb: float) -> Check:
    folder = database_folder(database)
    if folder is None:
        return Check(name="disk", passed=True, detail="is the database server's own")
    free = free_mb(folder)
    detail = f"{free:.0f} MB free, {least_mb:.0f} MB wanted"
    return Check(name="disk", passed=free >= least_mb, detail=detail)
