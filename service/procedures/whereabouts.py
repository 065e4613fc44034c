"""Where the robot is on its way, stored a few times a second for whoever watches.

A thread of its own writes: who looks after a moving robot never waits for the database.
"""

from contextlib import suppress
from threading import Event, Thread
from types import TracebackType

from sqlalchemy.exc import InternalError, OperationalError

from service.db.models import WhereaboutsRow
from service.procedures.job import Job

PERIOD_S = 0.2


class Whereabouts:
    """Stores what the motion loop saw last, while the job is still this worker's."""

    def __init__(self, job: Job) -> None:
        self._job = job
        self._seen: tuple[float, ...] | None = None
        self._over = Event()
        self._thread = Thread(target=self._run, name=f"whereabouts-{job.campaign}", daemon=True)

    def __enter__(self) -> "Whereabouts":
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._over.set()
        self._thread.join()

    def saw(self, joints: tuple[float, ...]) -> None:
        """Take the joints of the moving robot; costs nothing."""
        self._seen = joints

    def _run(self) -> None:
        stored = None
        while not self._over.wait(PERIOD_S):
            seen = self._seen
            if seen is None or seen == stored or not self._job.watch.may_continue():
                continue
            # Nothing is lost with it: a full disk or a locked database is told by what matters.
            with suppress(OperationalError, InternalError):
                self._store(seen)
                stored = seen

    def _store(self, joints: tuple[float, ...]) -> None:
        with self._job.database.write() as session:
            session.merge(WhereaboutsRow(campaign=self._job.campaign, joints=list(joints)))
