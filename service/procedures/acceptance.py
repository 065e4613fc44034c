"""What collecting writes: an attempt before it, a reading or a skip after it, each at once.

Every function works in the caller's transaction and first compares the fence of the job.
"""

from dataclasses import dataclass
from typing import Any

from sqlalchemy import exists, func, select
from sqlalchemy.orm import Session

from drivers.interfaces import TrackerReading
from service.campaigns import life
from service.clock import utc_now
from service.db.models import CampaignRow, PoseRow, ReadingRow, ReferenceRow
from service.jobs.watch import Stopped
from service.procedures.job import Job
from service.procedures.visit import Pace, Sight, approach_signs
from service.procedures.ways import NextVisit, Route


@dataclass(frozen=True)
class Attempt:
    """A visit that is about to start."""

    number: int
    approach: list[int]


@dataclass(frozen=True)
class Accepted:
    """A visit with a true reading."""

    visit: NextVisit
    attempt: Attempt
    sight: Sight
    temperature_degc: float | None
    overhead_s: float


def visits_ahead(session: Session, campaign: int, most: int) -> list[NextVisit]:
    """Return the next visits without a reading: the whole series, then its repeats."""
    ahead: list[NextVisit] = []
    for repeat in range(session.get_one(CampaignRow, campaign).repeats):
        read = exists().where(
            ReadingRow.campaign == campaign,
            ReadingRow.idx == PoseRow.idx,
            ReadingRow.repeat == repeat,
        )
        poses = session.scalars(
            select(PoseRow)
            .where(PoseRow.campaign == campaign, PoseRow.state == "planned", ~read)
            .order_by(PoseRow.idx)
            .limit(most - len(ahead))
        )
        ahead += [NextVisit(pose.idx, repeat, tuple(pose.commanded)) for pose in poses]
        if len(ahead) == most:
            break
    return ahead


def require_leave(session: Session, job: Job) -> None:
    """Raise unless the job is still this worker's and an operator still allows motion."""
    job.queue.hold_fence(session, job.claim)
    cause = job.life.wished_stop(session)
    if cause is not None:
        raise Stopped(cause)


def begin(session: Session, job: Job, visit: NextVisit, route: Route) -> Attempt:
    """Note an attempt right before its motion, so that a crash shows."""
    require_leave(session, job)
    pose = session.get_one(PoseRow, (job.campaign, visit.idx))
    if route.sides is not None:
        approach = list(route.sides)
    else:
        before = _approach_before(session, job.campaign, pose, len(visit.commanded))
        approach = approach_signs(route.start, visit.commanded, before)
    pose.attempt += 1
    pose.approach = approach
    return Attempt(pose.attempt, approach)


def skip(session: Session, job: Job, visit: NextVisit, reason: str) -> None:
    """Leave a pose out for the rest of the campaign."""
    job.queue.hold_fence(session, job.claim)
    pose = session.get_one(PoseRow, (job.campaign, visit.idx))
    pose.state, pose.reason = "skipped", reason
    life.advance(session.get_one(CampaignRow, job.campaign))
    session.flush()


def accept(session: Session, job: Job, accepted: Accepted, pace: Pace) -> None:
    """Store a reading, if the job is still this worker's."""
    job.queue.hold_fence(session, job.claim)
    campaign = session.get_one(CampaignRow, job.campaign)
    visit, sight = accepted.visit, accepted.sight
    row = _reading_row(accepted)
    row.campaign = campaign.id
    row.revision = life.advance(campaign)
    row.fence = job.claim.fence
    # A cell may state less as full speed than it drives.
    row.speed = pace.speed / max(pace.full_speed, pace.speed)
    row.payload_kg = campaign.payload_kg
    row.t_s = elapsed(session, campaign.id, sight.robot_time_s)
    session.add(row)
    session.flush()
    if visit.repeat == campaign.repeats - 1:
        session.get_one(PoseRow, (campaign.id, visit.idx)).state = "measured"
        session.flush()


def accept_reference(session: Session, job: Job, row: ReferenceRow) -> None:
    """Store what was read of a fixed nest, if the job is still this worker's."""
    job.queue.hold_fence(session, job.claim)
    row.campaign = job.campaign
    row.fence = job.claim.fence
    row.t_s = elapsed(session, job.campaign, row.robot_time_s)
    row.after_readings = count_readings(session, job.campaign)
    row.created = utc_now()
    session.add(row)
    session.flush()


def count_readings(session: Session, campaign: int) -> int:
    """Return how many readings of the robot the campaign has."""
    query = select(func.count()).where(ReadingRow.campaign == campaign)
    return session.scalar(query) or 0


def elapsed(session: Session, campaign: int, robot_time_s: float) -> float:
    """Time since the campaign's first reading on the robot's clock, which counts its warming up."""
    latest = _latest_reading(session, campaign)
    if latest is None:
        return 0.0
    # A controller that was restarted in between starts its clock anew.
    return latest.t_s + max(robot_time_s - latest.robot_time_s, 0.0)


def tracker_columns(reading: TrackerReading) -> dict[str, Any]:
    """Return the columns that hold a tracker's reading."""
    return {
        "position": list(reading.position),
        "orientation": None if reading.orientation is None else list(reading.orientation),
        "spread": reading.spread,
        "shots": reading.shots,
        "tracker_time_s": reading.time_s,
    }


def _reading_row(accepted: Accepted) -> ReadingRow:
    """Everything of a reading that the visit itself knows."""
    visit, sight = accepted.visit, accepted.sight
    return ReadingRow(
        idx=visit.idx,
        repeat=visit.repeat,
        attempt=accepted.attempt.number,
        joints=list(sight.joints),
        commanded=list(visit.commanded),
        **tracker_columns(sight.reading),
        temperature_degc=accepted.temperature_degc,
        approach=accepted.attempt.approach,
        settle_s=sight.settle_s,
        robot_time_s=sight.robot_time_s,
        motion_s=sight.seconds.motion,
        settling_s=sight.seconds.settling,
        measuring_s=sight.seconds.measuring,
        overhead_s=accepted.overhead_s,
        created=utc_now(),
    )


def _approach_before(session: Session, campaign: int, pose: PoseRow, n_joints: int) -> list[int]:
    """Directions of the joints' last moves before this one, as far as they are known."""
    latest = _latest_reading(session, campaign)
    accepted = select(func.max(ReadingRow.attempt)).where(
        ReadingRow.campaign == campaign, ReadingRow.idx == pose.idx
    )
    if pose.approach is not None and pose.attempt > (session.scalar(accepted) or 0):
        return pose.approach
    return [0] * n_joints if latest is None else latest.approach


def _latest_reading(session: Session, campaign: int) -> ReadingRow | None:
    return session.scalars(
        select(ReadingRow)
        .where(ReadingRow.campaign == campaign)
        .order_by(ReadingRow.id.desc())
        .limit(1)
    ).first()
