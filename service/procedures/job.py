"""What a procedure gets from its worker."""

from dataclasses import dataclass

from service.campaigns.life import WorkersSide
from service.db.engine import Database
from service.db.models import Document, JobRow
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

    def request(self) -> Document:
        """What a repeated computation is to compute."""
        with self.database.read() as session:
            request = session.get_one(JobRow, self.claim.job).request
        assert request is not None
        return request

    @property
    def life(self) -> WorkersSide:
        """What this job may do with its campaign."""
        return WorkersSide(self.queue, self.claim)
