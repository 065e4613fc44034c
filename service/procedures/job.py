"""What a procedure gets from its worker."""

from dataclasses import dataclass

from service.campaigns.life import WorkersSide
from service.db.engine import Database
from service.jobs.queue import Claim, JobQueue
from service.jobs.watch import Watch


class Held(Exception):
    """The campaign needs a person before it can go on; the message says what to do."""


@dataclass(frozen=True)
class Job:
    """One claimed job, the watch over it, and where its results go."""

    database: Database
    queue: JobQueue
    claim: Claim
    watch: Watch

    @property
    def campaign(self) -> int:
        """Number of the campaign."""
        return self.claim.campaign

    @property
    def life(self) -> WorkersSide:
        """What this job may do with its campaign."""
        return WorkersSide(self.queue, self.claim)
