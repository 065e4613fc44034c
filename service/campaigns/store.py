"""Campaigns in the database: make them, show them."""

import math
from dataclasses import dataclass
from datetime import datetime

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from robocal.formats.measurements_csv import joint_columns
from robocal.robots.library import load_robot, robot_path
from robocal.robots.robot import Robot
from service.campaigns import follow_ups
from service.campaigns.enough import require_enough
from service.campaigns.follow_ups import FollowUpPoses
from service.campaigns.life import is_armed, not_armed
from service.campaigns.models import (
    ENDED,
    Accepted,
    Campaign,
    CampaignKind,
    CampaignState,
    CriterionSettings,
    JointColumns,
    NewCampaign,
)
from service.campaigns.poses import add_poses
from service.cells import store as cells
from service.cells.bounds import narrowed
from service.clock import utc_now, utc_text
from service.db.models import BundleRow, CampaignRow, ParametersRow, PoseRow, ReadingRow
from service.errors import Conflict, Unusable
from service.jobs.queue import JobKind, JobQueue
from service.parameters import store as parameters
from service.parameters.models import ParametersState

_FEWEST_HEALTH_POSES = 4
"""With fewer, base, tool and joints cannot be told apart."""
PURPOSE_CALIBRATE = "calibrate"


def create(session: Session, queue: JobQueue, wanted: NewCampaign) -> Accepted:
    """Store a campaign and the job that drives it."""
    cell = cells.find(session, wanted.cell)
    if not is_armed(session, cell.name):
        raise Conflict(not_armed(cell.name))
    settings = cells.settings_of(cell)
    model = settings.robot.model
    robot = narrowed(load_robot(model), settings.limits)
    if wanted.kind is CampaignKind.calibrate and isinstance(wanted.poses, int):
        require_enough(robot, wanted.poses)
    row = CampaignRow(
        cell=cell.name,
        kind=wanted.kind,
        state=CampaignState.queued,
        pose_count=len(wanted.poses) if isinstance(wanted.poses, list) else wanted.poses or 0,
        repeats=wanted.repeats,
        settle_s=wanted.settle_s,
        seed=0,
        robot_yaml=robot_path(model).read_text(encoding="utf-8"),
        joint_units=list(robot.joint_units),
        cell_document=settings.model_dump(mode="json"),
        payload_kg=wanted.payload_kg,
        approach_turn=math.radians(wanted.approach_deg),
        approach_slide=wanted.approach_mm * 1e-3,
        created=utc_now(),
    )
    asked = FollowUpPoses([], [])
    if wanted.kind is CampaignKind.follow_up:
        asked = follow_ups.aim(session, row, wanted)
    elif wanted.poses is None or wanted.follows is not None or wanted.rounds is not None:
        raise Unusable(
            f"body: a campaign of kind '{wanted.kind}' needs poses and takes neither follows nor "
            "rounds; they belong to a follow_up."
        )
    if wanted.kind is CampaignKind.verify:
        _aim_verification(session, row, wanted)
    elif wanted.criterion is not None or wanted.parameters_version is not None:
        raise Unusable(
            f"body kind: '{wanted.kind}' takes neither criterion nor parameters_version; "
            "they belong to a verification."
        )
    if wanted.kind is CampaignKind.health:
        _aim_health_check(session, row)
    row.payload_kg = _held(session, row)
    session.add(row)
    session.flush()
    row.seed = _seed(row, wanted)
    if asked.joints:
        follow_ups.append_poses(session, row, asked)
    if isinstance(wanted.poses, list):
        joints = [_joints(robot, i, pose) for i, pose in enumerate(wanted.poses)]
        add_poses(session, row, joints, [PURPOSE_CALIBRATE] * len(joints))
    queue.enqueue(session, row.id, cell.name, JobKind.collect)
    return Accepted(id=row.id, state=CampaignState.queued)


@dataclass(frozen=True)
class Filter:
    """Which campaigns to show; None stands for any."""

    cell: str | None = None
    kinds: tuple[CampaignKind, ...] = tuple(CampaignKind)
    state: CampaignState | None = None
    since: datetime | None = None
    """Made at this time or later."""


EVERY = Filter()


def page(session: Session, wanted: Filter, before: int | None, limit: int) -> list[Campaign]:
    """Campaigns, newest first."""
    query = select(CampaignRow).order_by(CampaignRow.id.desc()).limit(limit)
    query = query.where(CampaignRow.kind.in_(wanted.kinds))
    for column, value in (
        (CampaignRow.cell, wanted.cell),
        (CampaignRow.state, wanted.state),
    ):
        if value is not None:
            query = query.where(column == value)
    if wanted.since is not None:
        query = query.where(CampaignRow.created >= utc_text(wanted.since))
    if before is not None:
        query = query.where(CampaignRow.id < before)
    return [shown(session, row) for row in session.scalars(query)]


def shown(session: Session, row: CampaignRow) -> Campaign:
    """Show a campaign as it goes over HTTP."""
    total = _total(session, row)
    imported = session.get(BundleRow, row.id) is not None
    done, mean_s = (total, None) if imported else _progress(session, row)
    state = CampaignState(row.state)
    remaining = 0.0 if done == total or state in ENDED else None
    if remaining is None and mean_s is not None:
        remaining = round(mean_s * (total - done), 1)
    return Campaign(
        id=row.id,
        cell=row.cell,
        kind=CampaignKind(row.kind),
        state=state,
        done=done,
        total=total,
        skipped=_skipped(session, row.id),
        remaining_s=remaining,
        reason=row.reason,
        revision=row.revision,
        repeats=row.repeats,
        settle_s=row.settle_s,
        payload_kg=row.payload_kg,
        seed=row.seed,
        parameters_version=row.parameters_version,
        criterion=None
        if row.criterion is None
        else CriterionSettings.model_validate(row.criterion),
        follows=row.follows,
        rounds=row.rounds,
        created=row.created,
        started=row.started,
        finished=row.finished,
    )


def _progress(session: Session, row: CampaignRow) -> tuple[int, float | None]:
    """Count the readings so far and take the mean time of one on the host's clock [s]."""
    visit = (
        ReadingRow.motion_s + ReadingRow.settling_s + ReadingRow.measuring_s + ReadingRow.overhead_s
    )
    done, mean_s = session.execute(
        select(func.count(), func.avg(visit)).where(ReadingRow.campaign == row.id)
    ).one()
    return done, mean_s


def _total(session: Session, row: CampaignRow) -> int:
    poses_per_target = 2 if row.kind == CampaignKind.verify else 1
    skipped = session.scalars(
        select(PoseRow.idx).where(PoseRow.campaign == row.id, PoseRow.state == "skipped")
    ).all()
    kept = row.pose_count * poses_per_target - len(skipped)
    if not skipped:
        return kept * row.repeats
    readings_there = session.scalar(
        select(func.count()).where(ReadingRow.campaign == row.id, ReadingRow.idx.in_(skipped))
    )
    return kept * row.repeats + (readings_there or 0)


def _skipped(session: Session, number: int) -> int:
    query = select(func.count()).where(PoseRow.campaign == number, PoseRow.state == "skipped")
    return session.scalar(query) or 0


def _joints(robot: Robot, number: int, pose: JointColumns) -> list[float]:
    columns = joint_columns(robot)
    if set(pose) != set(columns):
        raise Unusable(
            f"body poses.{number}: has {', '.join(sorted(pose))}; "
            f"robot '{robot.name}' needs {', '.join(columns)}."
        )
    q = np.array([pose[column] for column in columns]) * robot.joint_scale
    outside = (q < robot.limits[:, 0]) | (q > robot.limits[:, 1])
    if outside.any():
        joint = int(np.argmax(outside))
        low, high = robot.limits[joint] / robot.joint_scale[joint]
        raise Unusable(
            f"body poses.{number}.{columns[joint]}: {pose[columns[joint]]:g} is outside the "
            f"joint's limits {low:g} to {high:g}."
        )
    return [float(value) for value in q]


def _aim_verification(session: Session, row: CampaignRow, wanted: NewCampaign) -> None:
    """Note which version is verified and what it must reach."""
    if not isinstance(wanted.poses, int):
        raise Unusable("body poses: a verification plans its own poses; give their number.")
    criterion = wanted.criterion or CriterionSettings()
    row.criterion = criterion.model_dump(mode="json")
    if wanted.parameters_version is not None:
        version = parameters.version(session, wanted.cell, wanted.parameters_version)
        row.parameters_version = version.version
    else:
        row.parameters_version = _version_to_verify(session, wanted.cell)


def _aim_health_check(session: Session, row: CampaignRow) -> None:
    """Check the version that the MES reads."""
    if row.pose_count < _FEWEST_HEALTH_POSES:
        raise Unusable(
            f"body poses: {row.pose_count} cannot tell base, tool and joints apart; "
            f"a health check takes {_FEWEST_HEALTH_POSES} at least, 8 are sensible."
        )
    assert row.cell is not None
    released = parameters.newest(session, row.cell, ParametersState.released)
    row.parameters_version = released.version


def _held(session: Session, row: CampaignRow) -> float | None:
    """Payload as stated, else that of the campaign that is followed or checked [kg]."""
    if row.payload_kg is not None:
        return row.payload_kg
    origin = row.follows
    if row.parameters_version is not None:
        assert row.cell is not None
        origin = parameters.version(session, row.cell, row.parameters_version).campaign
    return None if origin is None else session.get_one(CampaignRow, origin).payload_kg


def _seed(row: CampaignRow, wanted: NewCampaign) -> int:
    if wanted.seed is not None:
        return wanted.seed
    # The checks of one version visit the same poses, so that they can be compared.
    return row.parameters_version or 0 if wanted.kind is CampaignKind.health else row.id


def _version_to_verify(session: Session, cell: str) -> int:
    version = session.scalar(
        select(func.max(ParametersRow.version)).where(
            ParametersRow.cell == cell, ParametersRow.state != ParametersState.superseded
        )
    )
    if version is None:
        raise Conflict(f"Cell '{cell}' has no parameters to verify; run a calibration first.")
    return version
