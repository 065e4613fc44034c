"""What one visit writes, against the database alone; the driving is in tests/integration."""

import pytest
from sqlalchemy import select

from drivers.interfaces import TrackerReading
from service.db.models import CellRow, JobRow, PoseRow, ReadingRow
from service.jobs.queue import LeaseLost
from service.jobs.watch import Stopped
from service.procedures.acceptance import Accepted, Attempt, accept, begin, skip, visits_ahead
from service.procedures.job import Job
from service.procedures.visit import Pace, Seconds, Sight
from service.procedures.ways import NextVisit, Route

PACE = Pace(speed=1.0, acceleration=2.0, full_speed=2.0, settle_s=0.1)


def sight(robot_time_s: float = 5.0) -> Sight:
    return Sight(
        joints=(0.0, 0.0),
        settle_s=0.1,
        robot_time_s=robot_time_s,
        reading=TrackerReading((1.0, 2.0, 3.0), None, 0.0, 1, robot_time_s),
        seconds=Seconds(1.0, 0.1, 0.2),
    )


def coming(job: Job) -> NextVisit | None:
    with job.database.read() as session:
        return next(iter(visits_ahead(session, 1, 1)), None)


def start(job: Job, visit: NextVisit, here=(0.0, 0.0), sides=None) -> Attempt:
    with job.database.write() as session:
        return begin(session, job, visit, Route(here, (visit.commanded,), sides, ""))


def store(job: Job, visit: NextVisit, attempt: Attempt, robot_time_s: float = 5.0) -> None:
    with job.database.write() as session:
        accept(session, job, Accepted(visit, attempt, sight(robot_time_s), 21.5, 0.05), PACE)


def visited(job: Job, robot_time_s: float = 5.0) -> None:
    store(job, coming(job), start(job, coming(job)), robot_time_s)


def test_the_series_comes_before_its_repeats(job):
    with job.database.read() as session:
        ahead = [(visit.idx, visit.repeat) for visit in visits_ahead(session, 1, 3)]
    visits = []
    while (visit := coming(job)) is not None:
        visits.append((visit.idx, visit.repeat))
        visited(job)
    assert visits == [(0, 0), (1, 0), (0, 1), (1, 1)]
    assert ahead == visits[:3]
    with job.database.read() as session:
        assert set(session.scalars(select(PoseRow.state))) == {"measured"}


def test_a_worker_that_lost_its_job_can_neither_start_nor_store(job):
    visit = coming(job)
    attempt = start(job, visit)
    with job.database.write() as session:
        session.get_one(JobRow, job.claim.job).fence += 1
    with pytest.raises(LeaseLost):
        start(job, visit)
    with pytest.raises(LeaseLost):
        store(job, visit, attempt)
    with pytest.raises(LeaseLost), job.database.write() as session:
        skip(session, job, visit, "because")
    with job.database.read() as session:
        assert session.scalars(select(ReadingRow)).all() == []
        pose = session.get_one(PoseRow, (1, 0))
        assert (pose.attempt, pose.state) == (1, "planned")


def test_nothing_starts_in_a_cell_that_was_disarmed(job):
    with job.database.write() as session:
        session.get_one(CellRow, "c").armed = False
    with pytest.raises(Stopped, match="disarmed"):
        start(job, coming(job))
    with job.database.read() as session:
        assert session.get_one(PoseRow, (1, 0)).attempt == 0


def test_the_approach_outlives_a_worker_that_died_on_arrival(job):
    first = start(job, coming(job))
    again = start(job, coming(job), (0.5, -0.5))
    assert first == Attempt(1, [1, -1])
    assert again == Attempt(2, [1, -1])


def test_a_joint_that_stays_keeps_the_direction_of_the_pose_before(job):
    visited(job)
    assert start(job, coming(job), (0.5, -0.5)).approach == [1, 1]


def test_the_stated_sides_are_what_is_stored(job):
    assert start(job, coming(job), (9.0, 9.0), (1, -1)).approach == [1, -1]


def test_a_skipped_pose_is_left_out_of_every_repeat_with_its_reason(job):
    with job.database.write() as session:
        skip(session, job, coming(job), "not driven: floor")
    with job.database.read() as session:
        assert [visit.idx for visit in visits_ahead(session, 1, 9)] == [1, 1]
        assert session.get_one(PoseRow, (1, 0)).reason == "not driven: floor"


def test_the_time_of_the_readings_goes_on_when_the_controller_was_restarted(job):
    for robot_time_s in (100.0, 103.0, 1.0, 2.5):
        visited(job, robot_time_s)
    with job.database.read() as session:
        times = session.scalars(select(ReadingRow.t_s).order_by(ReadingRow.id)).all()
    assert times == [0.0, 3.0, 3.0, 4.5]
