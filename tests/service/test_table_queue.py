"""The queue against a clock that the test sets: leases end when it says so."""

import time

import pytest
from sqlalchemy import update
from sqlalchemy.exc import IntegrityError

from service.clock import utc_now
from service.db.models import CampaignRow, CellRow, JobRow
from service.jobs.queue import JobEnd, JobKind, LeaseLost
from service.jobs.table_queue import TableQueue

LEASE_S = 5.0


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now = time.time()

        def time(self) -> float:
            return self.now

    fixed = Clock()
    monkeypatch.setattr("service.jobs.table_queue.time", fixed)
    return fixed


@pytest.fixture
def queue(database, clock):
    """Cells a and b; campaigns 1 and 2 on a, 3 on b, each with a job."""
    queue = TableQueue(database, LEASE_S)
    with database.write() as session:
        for name in ("a", "b"):
            session.add(CellRow(name=name, document={}, armed=True, created=utc_now()))
        session.flush()
        for number, cell in ((1, "a"), (2, "a"), (3, "b")):
            session.add(_campaign(number, cell))
            session.flush()
            queue.enqueue(session, number, cell, JobKind.collect)
    return queue


def _campaign(number: int, cell: str) -> CampaignRow:
    return CampaignRow(
        id=number,
        cell=cell,
        kind="calibrate",
        state="queued",
        pose_count=1,
        repeats=1,
        settle_s=0,
        seed=1,
        robot_yaml="",
        joint_units=[],
        created=utc_now(),
    )


def test_jobs_come_in_order_and_one_at_a_time_for_a_cell(queue, database):
    first, second = queue.claim("w1"), queue.claim("w2")
    assert (first.campaign, second.campaign) == (1, 3)
    assert queue.claim("w3") is None
    with database.write() as session:
        queue.end(session, first, JobEnd.done, "")
    assert queue.claim("w3").campaign == 2


def test_the_database_itself_refuses_two_running_jobs_on_a_cell(queue, database):
    both = update(JobRow).where(JobRow.cell == "a").values(state="running")
    with pytest.raises(IntegrityError), database.write() as session:
        session.execute(both)


def test_a_silent_worker_loses_its_job_to_the_next_one(queue, clock, database):
    old = queue.claim("w1")
    clock.now += LEASE_S - 0.1
    assert queue.claim("w2").campaign == 3
    clock.now += 0.2
    new = queue.claim("w2")
    assert (new.campaign, new.fence) == (1, old.fence + 1)
    with pytest.raises(LeaseLost):
        queue.renew(old)
    for act in (queue.hold_fence, lambda s, c: queue.end(s, c, JobEnd.done, "")):
        with pytest.raises(LeaseLost), database.write() as session:
            act(session, old)
    with database.write() as session:
        queue.hold_fence(session, new)


def test_a_renewed_lease_holds(queue, clock):
    claim = queue.claim("w1")
    for _ in range(3):
        clock.now += LEASE_S - 0.1
        assert queue.renew(claim) == clock.now + LEASE_S
    assert [queue.claim("w2").campaign, queue.claim("w3")] == [3, None]


def test_a_job_given_back_goes_to_the_next_worker_with_a_new_fence(queue, database):
    claim = queue.claim("w1")
    with database.write() as session:
        queue.end(session, claim, JobEnd.queued, "")
    again = queue.claim("w2")
    assert (again.job, again.fence) == (claim.job, claim.fence + 1)


def test_a_held_job_waits_until_it_is_put_back(queue, database):
    claim = queue.claim("w1")
    with database.write() as session:
        queue.end(session, claim, JobEnd.held, "device")
    assert queue.claim("w1").campaign == 2
    with database.write() as session:
        queue.requeue_held(session, 1)
    assert queue.claim("w2").campaign == 3
    assert queue.claim("w3") is None


def test_a_withdrawn_job_shuts_out_a_worker_that_only_seemed_dead(queue, clock, database):
    claim = queue.claim("w1")
    with database.read() as session:
        assert queue.is_worked_on(session, 1)
    clock.now += LEASE_S + 0.1
    with database.write() as session:
        assert not queue.is_worked_on(session, 1)
        queue.withdraw(session, 1, JobEnd.cancelled)
    with pytest.raises(LeaseLost):
        queue.renew(claim)
    assert queue.claim("w1").campaign == 2
