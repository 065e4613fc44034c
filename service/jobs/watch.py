"""A thread beside a running job: keeps the lease alive and sees when the job is to stop."""

import time
from collections.abc import Callable
from enum import StrEnum
from threading import Event

from service.background import Background
from service.jobs.queue import Claim, JobQueue, LeaseLost

_RENEWALS_PER_LEASE = 4


class Cause(StrEnum):
    """Why a job has to stop before its end."""

    abort = "abort"
    pause = "pause"
    disarmed = "disarmed"
    shutdown = "shutdown"
    lease_lost = "lease_lost"


class Stopped(Exception):
    """The job stops because it is no longer wanted, for the cause given."""

    def __init__(self, cause: Cause) -> None:
        super().__init__(f"stopped: {cause}")
        self.cause = cause


class Watch(Background):
    """Renews the lease and asks for the wish to stop; `may_continue` costs microseconds.

    Parameters
    ----------
    queue, claim
        The job.
    wished_stop
        Looks into the database for a wish to stop this job.
    shutdown
        Set when the worker itself has to end.
    period_s
        Time between two looks [s].
    is_aborted
        Whether a person's abort is told already that is still to be stored; costs microseconds.
    """

    def __init__(
        self,
        queue: JobQueue,
        claim: Claim,
        wished_stop: Callable[[], Cause | None],
        shutdown: Event,
        period_s: float,
        is_aborted: Callable[[], bool] = lambda: False,
    ) -> None:
        super().__init__(f"watch-job-{claim.job}")
        self._queue = queue
        self._claim = claim
        self._wished_stop = wished_stop
        self._shutdown = shutdown
        self._period_s = period_s
        self._is_aborted = is_aborted
        self._lease_until = claim.lease_until
        self._renewal_s = max(claim.lease_until - time.monotonic(), 0.0) / _RENEWALS_PER_LEASE
        self._cause: Cause | None = None

    def may_continue(self) -> bool:
        """Whether the job is still wanted and still this worker's."""
        return self.cause() is None

    def cause(self) -> Cause | None:
        """Why the job has to stop; None while it may go on."""
        if self._cause is not None:
            return self._cause
        # Also true when this thread was held up or the watching thread died: no lease, no motion.
        if time.monotonic() >= self._lease_until:
            return Cause.lease_lost
        # The watching thread may wait for a database that somebody else holds.
        if self._is_aborted():
            self._cause = Cause.abort
            return self._cause
        return Cause.shutdown if self._shutdown.is_set() else None

    def check(self) -> None:
        """Raise `Stopped` when the job has to stop."""
        cause = self.cause()
        if cause is not None:
            raise Stopped(cause)

    def wait(self, seconds: float) -> None:
        """Let time pass; raises `Stopped` when the job has to stop."""
        self._over.wait(seconds)
        self.check()

    def _run(self) -> None:
        renewed = time.monotonic()
        # The lease is kept also after a wish to stop: stopping the robot takes its time.
        while not self._over.wait(self._period_s):
            if time.monotonic() - renewed >= self._renewal_s:
                try:
                    self._lease_until = self._queue.renew(self._claim)
                except LeaseLost:
                    self._cause = Cause.lease_lost
                    return
                renewed = time.monotonic()
            wish = self._wished_stop()
            # What was seen meanwhile by whoever asked stays.
            if self._cause is None:
                self._cause = wish
