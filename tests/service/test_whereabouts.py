"""Where a moving robot is: what the motion loop saw comes into the database by itself."""

import time
from dataclasses import replace
from threading import Event

import pytest
from sqlalchemy import text

from service.db.models import JobRow, WhereaboutsRow
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


def test_the_last_that_was_seen_is_stored_at_the_end_also_after_a_wish_to_stop(job, monkeypatch):
    monkeypatch.setattr(whereabouts, "PERIOD_S", PATIENCE_S)
    shutdown = Event()
    shutdown.set()
    watch = Watch(job.queue, job.claim, lambda: None, shutdown, 1.0)
    with Whereabouts(replace(job, watch=watch)) as robot:
        robot.saw((0.1, 0.1))
    assert stored(job) == [0.1, 0.1]


def test_a_worker_that_lost_its_job_says_nothing_more(job):
    with Whereabouts(job) as robot:
        robot.saw((0.1, 0.1))
        await_stored(job, [0.1, 0.1])
        with job.database.write() as session:
            session.get_one(JobRow, job.claim.job).fence += 1
        robot.saw((0.9, 0.9))
    assert stored(job) == [0.1, 0.1]


def test_a_place_that_the_database_refuses_is_not_the_last_that_is_stored(job):
    with Whereabouts(job) as robot:
        with job.database.write() as session:
            session.execute(
                text(
                    "CREATE TRIGGER refuses BEFORE INSERT ON whereabouts WHEN NEW.campaign = 1 "
                    "BEGIN SELECT RAISE(ABORT, 'no'); END"
                )
            )
        robot.saw((0.1, 0.1))
        time.sleep(PERIODS * whereabouts.PERIOD_S)
        with job.database.write() as session:
            session.execute(text("DROP TRIGGER refuses"))
        await_stored(job, [0.1, 0.1])
