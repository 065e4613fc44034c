"""Collect the readings of a campaign, pose by pose; each is accepted in one transaction.

No engine makes a motion exactly once: the pose that was under way when a worker died is driven
again, with the next attempt number, but it is accepted once.
"""

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from sqlalchemy import exists, func, select
from sqlalchemy.orm import Session

from drivers.errors import DriverError
from drivers.interfaces import Robot, Tracker
from drivers.registry import open_robot, open_tracker
from service.campaigns import life
from service.cells import store as cells
from service.cells.models import NewCell
from service.clock import utc_now
from service.db.models import CampaignRow, CellRow, PoseRow, ReadingRow
from service.procedures.job import Held, Job
from service.procedures.plan import ensure_plan
from service.procedures.visit import Pace, Sight, approach_signs, pace_of, settle, visit


@dataclass(frozen=True)
class NextVisit:
    """The pose and repeat to be measured next."""

    idx: int
    repeat: int
    commanded: tuple[float, ...]


@dataclass(frozen=True)
class Attempt:
    """A visit that is about to start."""

    number: int
    approach: list[int]


@dataclass(frozen=True)
class Setup:
    """What does not change during a campaign."""

    cell: NewCell
    n_joints: int
    pace: Pace


def collect(job: Job) -> None:
    """Drive the campaign to its end; raises `Held` when a device needs a person."""
    setup = _setup(job)
    ensure_plan(job)
    try:
        with _devices(setup) as (robot, tracker):
            # A motion that a dead worker had started may still be under way.
            robot.stop()
            settle(robot, 0.0, job.watch)
            since: float | None = time.perf_counter()
            while since is not None:
                since = _measure_next(job, setup, robot, tracker, since)
    except DriverError as error:
        job.watch.check()
        raise Held(str(error)) from error


def _setup(job: Job) -> Setup:
    with job.database.read() as session:
        row = session.get_one(CampaignRow, job.campaign)
        cell_row = session.get_one(CellRow, row.cell)
        if not cell_row.armed:
            raise Held(life.not_armed(cell_row.name))
        cell = cells.settings_of(cell_row)
        return Setup(cell, len(row.joint_units), pace_of(cell.limits, row.settle_s))


@contextmanager
def _devices(setup: Setup) -> Iterator[tuple[Robot, Tracker]]:
    """Robot and tracker; whatever happens, the robot is stopped and both are let go."""
    robot_settings, tracker_settings = setup.cell.robot, setup.cell.tracker
    with ExitStack() as stack:
        tracker = open_tracker(tracker_settings.driver, tracker_settings.address)
        stack.callback(tracker.close)
        tracker.connect()
        robot = open_robot(robot_settings.driver, robot_settings.address, setup.n_joints)
        stack.callback(robot.close)
        robot.connect()
        stack.callback(robot.stop)
        yield robot, tracker


def _measure_next(
    job: Job, setup: Setup, robot: Robot, tracker: Tracker, since: float
) -> float | None:
    """Measure one pose; the moment of its acceptance, or None when there is no further one."""
    with job.database.read() as session:
        coming = next_visit(session, job.campaign)
    if coming is None:
        # Only after a person skipped the last pose: otherwise its reading ends the collecting.
        with job.database.write() as session:
            job.life.finish_collecting(session)
        return None
    attempt = _begin(job, coming, robot.state().joints)
    job.watch.check()
    sight = visit(robot, tracker, coming.commanded, setup.pace, job.watch)
    spent = sight.seconds
    with job.database.write() as session:
        accepted = time.perf_counter()
        overhead_s = accepted - since - spent.motion - spent.settling - spent.measuring
        _accept(session, job, coming, attempt, sight, setup.pace, overhead_s)
        if next_visit(session, job.campaign) is not None:
            return accepted
        # In the same transaction as the last reading: a crash leaves both or none.
        job.life.finish_collecting(session)
        return None


def next_visit(session: Session, campaign: int) -> NextVisit | None:
    """Return the first visit without a reading: the whole series, then its repeats."""
    repeats = session.get_one(CampaignRow, campaign).repeats
    for repeat in range(repeats):
        read = exists().where(
            ReadingRow.campaign == campaign,
            ReadingRow.idx == PoseRow.idx,
            ReadingRow.repeat == repeat,
        )
        pose = session.scalars(
            select(PoseRow)
            .where(PoseRow.campaign == campaign, PoseRow.state == "planned", ~read)
            .order_by(PoseRow.idx)
            .limit(1)
        ).first()
        if pose is not None:
            return NextVisit(pose.idx, repeat, tuple(pose.commanded))
    return None


def _begin(job: Job, coming: NextVisit, joints: tuple[float, ...]) -> Attempt:
    """Check the lease right before the motion, and note the attempt so that a crash shows."""
    with job.database.write() as session:
        job.queue.hold_fence(session, job.claim)
        pose = session.get_one(PoseRow, (job.campaign, coming.idx))
        latest = _latest_reading(session, job.campaign)
        before = [0] * len(joints)
        if latest is not None:
            before = latest.approach
        if pose.approach is not None and pose.attempt > _accepted_attempt(
            session, job.campaign, pose.idx
        ):
            before = pose.approach
        pose.attempt += 1
        pose.approach = approach_signs(joints, coming.commanded, before)
        return Attempt(pose.attempt, pose.approach)


def _accept(
    session: Session,
    job: Job,
    coming: NextVisit,
    attempt: Attempt,
    sight: Sight,
    pace: Pace,
    overhead_s: float,
) -> None:
    """Store a reading, if the job is still this worker's."""
    job.queue.hold_fence(session, job.claim)
    campaign = session.get_one(CampaignRow, job.campaign)
    row = _reading_row(coming, attempt, sight)
    row.campaign = campaign.id
    row.revision = life.advance(campaign)
    row.fence = job.claim.fence
    row.speed = pace.speed / pace.full_speed
    row.t_s = _elapsed(_latest_reading(session, campaign.id), sight.robot_time_s)
    row.overhead_s = overhead_s
    session.add(row)
    session.flush()
    if coming.repeat == campaign.repeats - 1:
        session.get_one(PoseRow, (campaign.id, coming.idx)).state = "measured"
        session.flush()


def _reading_row(coming: NextVisit, attempt: Attempt, sight: Sight) -> ReadingRow:
    """Everything of a reading that the visit itself knows."""
    reading = sight.reading
    return ReadingRow(
        idx=coming.idx,
        repeat=coming.repeat,
        attempt=attempt.number,
        joints=list(sight.joints),
        commanded=list(coming.commanded),
        position=list(reading.position),
        orientation=None if reading.orientation is None else list(reading.orientation),
        spread=reading.spread,
        shots=reading.shots,
        approach=attempt.approach,
        settle_s=sight.settle_s,
        robot_time_s=sight.robot_time_s,
        tracker_time_s=reading.time_s,
        motion_s=sight.seconds.motion,
        settling_s=sight.seconds.settling,
        measuring_s=sight.seconds.measuring,
        created=utc_now(),
    )


def _latest_reading(session: Session, campaign: int) -> ReadingRow | None:
    return session.scalars(
        select(ReadingRow)
        .where(ReadingRow.campaign == campaign)
        .order_by(ReadingRow.id.desc())
        .limit(1)
    ).first()


def _accepted_attempt(session: Session, campaign: int, idx: int) -> int:
    number = session.scalar(
        select(func.max(ReadingRow.attempt)).where(
            ReadingRow.campaign == campaign, ReadingRow.idx == idx
        )
    )
    return number or 0


def _elapsed(latest: ReadingRow | None, robot_time_s: float) -> float:
    """Time since the campaign's first reading on the robot's clock, which counts its warming up."""
    if latest is None:
        return 0.0
    # A controller that was restarted in between starts its clock anew.
    return latest.t_s + max(robot_time_s - latest.robot_time_s, 0.0)
