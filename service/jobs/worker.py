"""The worker: `python -m service.jobs.worker` takes jobs until it is told to end (SIGTERM).

A process of its own, so that the service can be restarted while a robot moves. At the end it
stops the robot and gives its job back.
"""

import json
import logging
import os
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from threading import Event, Thread

from sqlalchemy.exc import DatabaseError, InternalError, OperationalError

from robocal.errors import BadInput
from service.campaigns.life import WorkersSide
from service.campaigns.repeats import RepeatSide
from service.campaigns.stop_flag import StopFlag
from service.db.engine import Database, open_database
from service.db.trouble import is_damaged, trouble_of
from service.jobs.queue import Claim, JobKind, JobQueue, LeaseLost
from service.jobs.queues import open_queue
from service.jobs.shutdown import shutdown_by_signal
from service.jobs.watch import Cause, Stopped, Watch
from service.logs import about, set_up_logs
from service.parent import end_with_parent
from service.procedures.analyse import analyse
from service.procedures.collect import collect
from service.procedures.diagnose import diagnose, repeat
from service.procedures.job import Held, Job
from service.settings import Settings
from service.start_up import keep_what_is_loaded, prepare_database, read_settings
from service.webhooks.sender import Sender

PROCEDURES: dict[JobKind, Callable[[Job], None]] = {
    JobKind.collect: collect,
    JobKind.analyse: analyse,
    JobKind.diagnose: diagnose,
    JobKind.repeat: repeat,
}

_SENDER_GRACE_S = 0.5
"""How long a delivery under way may keep the worker from ending [s]."""

HURRY = -10
"""Added to the priority's number: less comes first."""

log = logging.getLogger("robocal.worker")

# PostgreSQL calls it an internal error when it has thrown out who slept in a transaction.
_OUT_OF_REACH = (OperationalError, InternalError)
_LONGEST_PAUSE_S = 5.0


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
        pause_s = self.settings.idle_s
        while not self.shutdown.is_set():
            try:
                claim = self.queue.claim(self.name)
                pause_s = self.settings.idle_s
                if claim is None:
                    self.shutdown.wait(self.settings.idle_s)
                    continue
                with about(claim):
                    self._work(claim)
            except LeaseLost as lost:
                # The job goes on elsewhere or was ended; nothing of it may be touched here.
                log.warning("%s", lost)
            except DatabaseError as error:
                # Locked or out of reach for now, or damaged until somebody restores it. The lease
                # of a job in hand runs out, and it is taken up where it stood.
                if not (isinstance(error, _OUT_OF_REACH) or is_damaged(error)):
                    raise
                log.warning("trying again: %s (%s)", trouble_of(error), error.orig)
                self.shutdown.wait(pause_s)
                # A log that grows fast would fill a full disk further.
                pause_s = min(2.0 * pause_s, _LONGEST_PAUSE_S)

    def _work(self, claim: Claim) -> None:
        repeated = claim.kind is JobKind.repeat
        life = (RepeatSide if repeated else WorkersSide)(self.queue, claim)

        def wished_stop() -> Cause | None:
            with self.database.read() as session:
                return life.wished_stop(session)

        watch = Watch(
            self.queue,
            claim,
            wished_stop,
            self.shutdown,
            self.settings.watch_s,
            # A computation that is repeated belongs to a campaign that has ended.
            (lambda: False) if repeated else StopFlag(self.database, claim.campaign).is_up,
        )
        with watch:
            try:
                with self.database.write() as session:
                    life.start(session)
                log.info("took the job")
                PROCEDURES[claim.kind](Job(self.database, self.queue, claim, watch))
            except (LeaseLost, *_OUT_OF_REACH):
                raise
            except Stopped as stopped:
                log.info("%s", stopped)
                with self.database.write() as session:
                    life.stop(session, stopped.cause)
            except Held as held:
                log.warning("the campaign is paused: %s", held)
                with self.database.write() as session:
                    life.hold(session, str(held))
            except Exception as error:
                if is_damaged(error):
                    raise
                log.exception("the campaign failed")
                with self.database.write() as session:
                    life.fail(session, str(error) or type(error).__name__)


def main() -> None:
    """Run a worker as the environment's settings say."""
    set_up_logs("worker")
    if sys.platform != "win32":
        # Who looks after a moving arm goes before computations, where the system permits it.
        with suppress(PermissionError):
            os.nice(HURRY)
    end_with_parent()
    try:
        settings = read_settings()
        logging.getLogger().setLevel(settings.log_level)
        prepare_database(settings)
    except BadInput as fault:
        log.critical("%s", fault)
        sys.exit(2)
    # Until now there was nothing to give back, and a signal ended the start at once.
    shutdown = shutdown_by_signal()
    database = open_database(settings.database_url, settings.busy_s)
    name = f"{socket.gethostname()}:{os.getpid()}"
    keep_what_is_loaded()
    sys.stdout.write(json.dumps({"ready": True, "worker": name}) + "\n")
    sys.stdout.flush()
    queue = open_queue(database, settings.lease_s)
    sender = Thread(target=Sender(database, settings, shutdown).run, name="webhooks", daemon=True)
    sender.start()
    Worker(name, database, queue, settings, shutdown).run()
    # A receiver that does not answer may not keep the worker: its delivery is sent again.
    sender.join(_SENDER_GRACE_S)
    try:
        queue.leave(name)
    except _OUT_OF_REACH as error:
        log.warning("left without a word: %s (%s)", trouble_of(error), error.orig)
    database.close()


if __name__ == "__main__":
    main()
