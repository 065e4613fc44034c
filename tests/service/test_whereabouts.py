"""Where a moving robot is: what the motion loop saw comes into the database by itself."""

import time
from dataclasses import replace
from threading import Event

import pytest
from sqlalchemy import text

from service.db.models import WhereaboutsRow
from service.jobs.watch import Watch
from service.procedures import whereabouts
from service.procedures.job import Job
from service.procedures.whereabouts import Whereabouts
from tests.serving import PATIENCE_S

PERIODS = 20


@pytest.fixture(autouse=True)
def often(monkeypatch) -> None:
    monkeypatch.setattr(whereabouts, "PERIOD_S", 0.01)


def stored(job: Job) -> list[float] | None:
    with job.database.read() as session:
        row = session.get(WhereaboutsRow, job.campaign)
        return None if row is None else row.joints


def await_stored(job: Job, joints: list[float]) -> None:
    until = time.monotonic() + PATIENCE_S
    while stored(job) != joints:
        assert time.monotonic() < until
        time.sleep(0.01)


def test_the_latest_that_was_seen_is_stored(job):
    with Whereabouts(job) as robot:
        for joints in ((0.0, 0.1), (0.2, 0.3)):
            robot.saw(joints)
            await_stored(job, list(joints))
    assert stored(job) == [0.2, 0.3]


def test_a_locked_database_keeps_nobody_waiting_and_loses_only_what_is_old(job):
    with Whereabouts(job) as robot:
        with job.database.write() as session:
            session.execute(text("SELECT 1"))
            for step in range(PERIODS):
                robot.saw((0.0, float(step)))
                time.sleep(whereabouts.PERIOD_S)
            assert stored(job) is None
        await_stored(job, [0.0, PERIODS - 1.0])


def test_a_worker_that_lost_its_job_says_nothing_more(job):
    shutdown = Event()
    watch = Watch(job.queue, job.claim, lambda: None, shutdown, 1.0)
    with Whereabouts(replace(job, watch=watch)) as robot:
        robot.saw((0.1, 0.1))
        await_stored(job, [0.1, 0.1])
        shutdown.set()
        robot.saw((0.9, 0.9))
        time.sleep(PERIODS * whereabouts.PERIOD_S)
    assert stored(job) == [0.1, 0.1]
