"""The worker: `python -m service.jobs.worker` takes jobs until it is told to end (SIGTERM).

A process of its own, so that the service can be restarted while a robot moves. At the end it
stops the robot and gives its job back.
"""

import json
import logging
import os
import signal
import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass
from threading import Event
from types import FrameType

from sqlalchemy.exc import OperationalError

from service.campaigns.life import WorkersSide
from service.db.engine import Database, open_database
from service.db.upgrade import upgrade_schema
from service.jobs.queue import Claim, JobKind, JobQueue, LeaseLost
from service.jobs.table_queue import TableQueue
from service.jobs.watch import Cause, Stopped, Watch
from service.parent import end_with_parent
from service.procedures.analyse import analyse
from service.procedures.collect import collect
from service.procedures.job import Held, Job
from service.settings import Settings

PROCEDURES: dict[JobKind, Callable[[Job], None]] = {
    JobKind.collect: collect,
    JobKind.analyse: analyse,
}

log = logging.getLogger("robocal.worker")


@dataclass(frozen=True)
class Worker:
    """Takes one job at a time."""

    name: str
    database: Database
    queue: JobQueue
    settings: Settings
    shutdown: Event

    def run(self) -> None:
        """Take jobs until the shutdown is wanted."""
        while not self.shutdown.is_set():
            try:
                claim = self.queue.claim(self.name)
                if claim is None:
                    self.shutdown.wait(self.settings.idle_s)
                else:
                    self._work(claim)
            except LeaseLost as lost:
                # The job goes on elsewhere or was ended; nothing of it may be touched here.
                log.warning("%s", lost)
            except OperationalError as error:
                # Locked or out of reach for now. The lease of a job in hand runs out, and it is
                # taken up where it stood.
                log.warning("the database does not answer, trying again: %s", error.orig)
                self.shutdown.wait(self.settings.idle_s)

    def _work(self, claim: Claim) -> None:
        life = WorkersSide(self.queue, claim)

        def wished_stop() -> Cause | None:
            with self.database.read() as session:
                return life.wished_stop(session)

        watch = Watch(self.queue, claim, wished_stop, self.shutdown, self.settings.watch_s)
        with watch:
            try:
                with self.database.write() as session:
                    life.start(session)
                PROCEDURES[claim.kind](Job(self.database, self.queue, claim, watch))
            except (LeaseLost, OperationalError):
                raise
            except Stopped as stopped:
                log.info("campaign %d: %s", claim.campaign, stopped)
                with self.database.write() as session:
                    life.stop(session, stopped.cause)
            except Held as held:
                log.warning("campaign %d is paused: %s", claim.campaign, held)
                with self.database.write() as session:
                    life.hold(session, str(held))
            except Exception as error:
                log.exception("campaign %d failed", claim.campaign)
                with self.database.write() as session:
                    life.fail(session, str(error) or type(error).__name__)


def main() -> None:
    """Run a worker as the environment's settings say."""
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(name)s %(levelname)s %(message)s")
    logging.getLogger("alembic").setLevel(logging.WARNING)
    settings = Settings()
    shutdown = Event()

    def end(number: int, frame: FrameType | None) -> None:
        shutdown.set()

    signal.signal(signal.SIGTERM, end)
    signal.signal(signal.SIGINT, end)
    end_with_parent()
    database = open_database(settings.database_url, settings.busy_s)
    upgrade_schema(database)
    name = f"{socket.gethostname()}:{os.getpid()}"
    sys.stdout.write(json.dumps({"ready": True, "worker": name}) + "\n")
    sys.stdout.flush()
    Worker(name, database, TableQueue(database, settings.lease_s), settings, shutdown).run()
    database.close()


if __name__ == "__main__":
    main()
