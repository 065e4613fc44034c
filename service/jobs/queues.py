"""Which queue a database has: the small table is for one host, and never offered to several."""

from service.db.engine import Database
from service.jobs.procrastinate_queue import ProcrastinateQueue
from service.jobs.queue import JobQueue
from service.jobs.table_queue import TableQueue


def open_queue(database: Database, lease_s: float) -> JobQueue:
    """Return the queue that goes with the database."""
    if database.on_one_host:
        return TableQueue(database, lease_s)
    return ProcrastinateQueue(database, lease_s)
