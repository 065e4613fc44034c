"""Both queues against a clock that the test sets: leases end when it says so."""

import time
from collections.abc import Iterator

import pytest
from sqlalchemy import select, text, update
from sqlalchemy.exc import IntegrityError

from service.clock import utc_now
from service.db.engine import Database, open_database
from service.db.models import CampaignRow, CellRow, JobRow
from service.jobs.procrastinate_queue import ProcrastinateQueue
from service.jobs.queue import JobEnd, JobKind, JobQueue, LeaseLost
from service.jobs.queues import open_queue

LEASE_S = 120.0
MARGIN_S = 50.0
"""More real time than a test takes: the server's clock goes on by itself."""
SEVERAL_HOSTS, ONE_HOST = "several hosts", "one host"


class Cell:
    """Queues as the service and the workers have them, and the clock of their leases."""

    def __init__(self, database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
        self.database = database
        self._queues: dict[str, JobQueue] = {}
        self.now = time.monotonic()
        monkeypatch.setattr("service.jobs.table_queue.time", self)
        monkeypatch.setattr("service.jobs.procrastinate_queue.time", self)

    def monotonic(self) -> float:
        return self.now

    def __getitem__(self, worker: str) -> JobQueue:
        """One object for every process."""
        if worker not in self._queues:
            self._queues[worker] = open_queue(self.database, LEASE_S)
        return self._queues[worker]

    def advance(self, seconds: float) -> None:
        """Let time pass for all."""
        self.now += seconds
        if not self.database.on_one_host:
            with self.database.write() as session:
                session.execute(
                    text(
                        "UPDATE procrastinate_workers "
                        f"SET last_heartbeat = last_heartbeat - interval '{seconds} seconds'"
                    )
                )

    def claim(self, worker: str) -> int | None:
        """Number of the campaign that the worker gets."""
        claim = self[worker].claim(worker)
        return None if claim is None else claim.campaign

    def end(self, worker: str, claim, end: JobEnd) -> None:
        with self.database.write() as session:
            self[worker].end(session, claim, end, "")


@pytest.fixture(params=[ONE_HOST, SEVERAL_HOSTS])
def database(request) -> Iterator[Database]:
    setting = "database_url" if request.param == ONE_HOST else "postgresql_url"
    opened = open_database(request.getfixturevalue(setting))
    yield opened
    opened.close()


@pytest.fixture
def cell(database, monkeypatch) -> Cell:
    """Cells a and b; campaigns 1 and 2 on a, 3 on b, each with a job."""
    made = Cell(database, monkeypatch)
    with database.write() as session:
        for name in ("a", "b"):
            session.add(CellRow(name=name, document={}, armed=True, created=utc_now()))
        session.flush()
        for number, name in ((1, "a"), (2, "a"), (3, "b")):
            session.add(_campaign(number, name))
            session.flush()
            made["service"].enqueue(session, number, name, JobKind.collect)
    return made


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


def test_jobs_come_in_order_and_one_at_a_time_for_a_cell(cell):
    first, second = cell["w1"].claim("w1"), cell["w2"].claim("w2")
    assert (first.campaign, second.campaign) == (1, 3)
    assert cell.claim("w3") is None
    cell.end("w1", first, JobEnd.done)
    assert cell.claim("w3") == 2


def test_the_database_itself_refuses_two_running_jobs_on_a_cell(cell, database):
    both = update(JobRow).where(JobRow.cell == "a").values(state="running")
    with pytest.raises(IntegrityError), database.write() as session:
        session.execute(both)


def test_a_job_of_a_transaction_that_fails_was_never_queued(cell, database):
    with database.write() as session:
        cell["service"].enqueue(session, 3, None, JobKind.analyse)
        session.rollback()
    assert [cell.claim("w1"), cell.claim("w2"), cell.claim("w3")] == [1, 3, None]


def test_a_silent_worker_loses_its_job_to_the_next_one(cell, database):
    old = cell["w1"].claim("w1")
    cell.advance(LEASE_S - MARGIN_S)
    assert cell.claim("w2") == 3
    cell.advance(2 * MARGIN_S)
    new = cell["w3"].claim("w3")
    assert (new.campaign, new.fence) == (1, old.fence + 1)
    with pytest.raises(LeaseLost):
        cell["w1"].renew(old)
    acts = (cell["w1"].hold_fence, lambda s, c: cell["w1"].end(s, c, JobEnd.done, ""))
    for act in acts:
        with pytest.raises(LeaseLost), database.write() as session:
            act(session, old)
    with database.write() as session:
        cell["w3"].hold_fence(session, new)


def test_a_renewed_lease_holds(cell):
    claim = cell["w1"].claim("w1")
    for _ in range(3):
        cell.advance(LEASE_S - MARGIN_S)
        assert cell["w1"].renew(claim) == cell.now + LEASE_S
    assert [cell.claim("w2"), cell.claim("w3")] == [3, None]


def test_a_job_given_back_goes_to_the_next_worker_with_a_new_fence(cell):
    claim = cell["w1"].claim("w1")
    cell.end("w1", claim, JobEnd.queued)
    again = cell["w2"].claim("w2")
    assert (again.job, again.fence) == (claim.job, claim.fence + 1)


def test_a_held_job_waits_until_it_is_put_back(cell, database):
    cell.end("w1", cell["w1"].claim("w1"), JobEnd.held)
    held = cell["w1"].claim("w1")
    assert held.campaign == 2
    with database.write() as session:
        cell["service"].requeue_held(session, 1)
    assert [cell.claim("w2"), cell.claim("w3")] == [3, None]
    cell.end("w1", held, JobEnd.done)
    assert cell.claim("w3") == 1


def test_a_withdrawn_job_shuts_out_a_worker_that_only_seemed_dead(cell, database):
    claim = cell["w1"].claim("w1")
    with database.read() as session:
        assert cell["service"].is_worked_on(session, 1)
    cell.advance(LEASE_S + 0.1)
    with database.write() as session:
        assert not cell["service"].is_worked_on(session, 1)
        cell["service"].withdraw(session, 1, JobEnd.cancelled)
    with pytest.raises(LeaseLost):
        cell["w1"].renew(claim)
    assert cell.claim("w1") == 2


def test_a_withdrawn_waiting_job_comes_to_nobody(cell, database):
    with database.write() as session:
        cell["service"].withdraw(session, 1, JobEnd.cancelled)
    assert [cell.claim("w1"), cell.claim("w2"), cell.claim("w3")] == [2, 3, None]


def test_workers_count_as_live_for_the_length_of_a_lease(cell, database):
    def live() -> int:
        with database.read() as session:
            return cell["service"].live_workers(session)

    assert live() == 0
    for worker in ("w1", "w2", "w3"):
        cell[worker].claim(worker)
    assert live() == 3
    cell["w2"].leave("w2")
    assert live() == 2
    cell.advance(LEASE_S - MARGIN_S)
    cell.claim("w3")
    cell.advance(2 * MARGIN_S)
    assert live() == 1


def test_a_worker_that_slept_until_it_was_forgotten_works_on(cell):
    claim = cell["w1"].claim("w1")
    cell.end("w1", claim, JobEnd.done)
    cell.advance(1000 * LEASE_S)
    cell.claim("w2")
    assert cell.claim("w1") == 3


def test_after_the_machine_started_anew_no_lease_of_before_holds(tmp_path, request, monkeypatch):
    database = open_database(request.getfixturevalue("database_url"))
    cell = Cell(database, monkeypatch)
    cell.now = 80_000.0
    with database.write() as session:
        session.add(_campaign(1, None))
        session.flush()
        cell["service"].enqueue(session, 1, None, JobKind.analyse)
    assert cell.claim("w1") == 1
    cell.now = 20.0
    assert cell.claim("w2") == 1
    database.close()


def test_a_server_whose_clock_was_set_back_lets_no_dead_worker_keep_its_job(cell, database):
    if database.on_one_host:
        return
    cell.claim("w1")
    cell.claim("w2")
    cell.advance(-3600.0)
    assert cell.claim("w3") is None
    cell.advance(LEASE_S + 0.1)
    assert cell.claim("w3") == 1


def test_delivered_jobs_leave_nothing_in_the_queue(cell, database):
    if not isinstance(cell["w1"], ProcrastinateQueue):
        return
    for worker in ("w1", "w2", "w1"):
        cell.end(worker, cell[worker].claim(worker), JobEnd.done)
    with database.read() as session:
        assert session.scalar(text("SELECT count(*) FROM procrastinate_jobs")) == 0
        assert set(session.scalars(select(JobRow.state))) == {"done"}
