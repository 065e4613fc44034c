"""Where the robot is on its way, stored a few times a second for whoever watches.

A thread of its own writes: who looks after a moving robot never waits for the database.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from sqlalchemy.exc import SQLAlchemyError

from drivers.errors import DriverError
from drivers.interfaces import Robot
from service.background import Background
from service.db.models import WhereaboutsRow
from service.jobs.queue import LeaseLost
from service.jobs.watch import Cause
from service.procedures.job import Job

PERIOD_S = 0.2
BRAKING_S = 1.0
"""How long a robot that was stopped is watched until it stands [s]."""
_LOOK_S = 0.02


class Whereabouts(Background):
    """Stores what the motion loop saw last, while the job is still this worker's.

    Leaving it stores the very last: leave it when the devices are let go, for it may wait for the
    database.
    """

    def __init__(self, job: Job) -> None:
        super().__init__(f"whereabouts-{job.campaign}")
        self._job = job
        self._seen: tuple[float, ...] | None = None

    def saw(self, joints: tuple[float, ...]) -> None:
        """Take the joints of the moving robot; costs nothing."""
        self._seen = joints

    @contextmanager
    def to_rest(self, robot: Robot) -> Iterator[None]:
        """At the end, whatever it was, see where the robot comes to rest; it is stopped by then."""
        try:
            yield
        finally:
            # Who lost the job lets go of the robot at once: it may soon move for another worker.
            if self._job.watch.cause() is not Cause.lease_lost:
                with suppress(DriverError):
                    self._see_braking(robot)

    def _see_braking(self, robot: Robot) -> None:
        until = time.monotonic() + BRAKING_S
        while True:
            state = robot.state()
            self.saw(state.joints)
            if not state.moving or time.monotonic() >= until:
                return
            time.sleep(_LOOK_S)

    def _run(self) -> None:
        stored, over = None, False
        while not over:
            over = self._over.wait(PERIOD_S)
            seen = self._seen
            if seen is None or seen == stored:
                continue
            # Nothing is lost with it: a full disk or a locked database is told by what matters.
            with suppress(SQLAlchemyError, LeaseLost):
                self._store(seen)
                stored = seen

    def _store(self, joints: tuple[float, ...]) -> None:
        job = self._job
        with job.database.write() as session:
            job.queue.hold_fence(session, job.claim)
            session.merge(WhereaboutsRow(campaign=job.campaign, joints=list(joints)))
