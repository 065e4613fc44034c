"""What is in the database, as gauges that are read when the monitor asks."""

from collections.abc import Iterator

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.db.engine import Database, database_folder
from service.db.models import CampaignRow, JobRow, ParametersRow, ReadingRow
from service.jobs.queue import JobQueue
from service.readiness import free_mb

_BYTES_PER_MB = 1e6


class Stock(Collector):
    """Campaigns, jobs, workers, readings and room on the disk."""

    def __init__(self, database: Database, queue: JobQueue) -> None:
        self._database = database
        self._queue = queue

    def collect(self) -> Iterator[Metric]:
        """Read everything in one look."""
        with self._database.read() as session:
            yield _by_state("robocal_campaigns", "Campaigns.", session, CampaignRow)
            yield _by_state("robocal_jobs", "Jobs.", session, JobRow)
            yield _by_state("robocal_parameters", "Versions of parameters.", session, ParametersRow)
            readings = session.scalar(select(func.count()).select_from(ReadingRow)) or 0
            yield CounterMetricFamily("robocal_readings", "Accepted readings.", readings)
            workers = self._queue.live_workers(session)
            yield GaugeMetricFamily(
                "robocal_workers_live", "Workers heard of within a lease.", workers
            )
        folder = database_folder(self._database)
        if folder is not None:
            yield GaugeMetricFamily(
                "robocal_disk_free_bytes",
                "Room on the database's disk.",
                free_mb(folder) * _BYTES_PER_MB,
            )


def _by_state(
    name: str,
    words: str,
    session: Session,
    table: type[CampaignRow] | type[JobRow] | type[ParametersRow],
) -> GaugeMetricFamily:
    family = GaugeMetricFamily(name, words, labels=("state",))
    for state, count in session.execute(select(table.state, func.count()).group_by(table.state)):
        family.add_metric((state,), count)
    return family
