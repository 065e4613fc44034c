"""Campaigns in the database: make them, show them."""

from collections.abc import Sequence

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from robocal.formats.measurements_csv import joint_columns
from robocal.robots.library import load_robot, robot_path
from robocal.robots.robot import Robot
from service.campaigns.enough import require_enough
from service.campaigns.life import is_armed, not_armed
from service.campaigns.models import (
    ENDED,
    Accepted,
    Campaign,
    CampaignKind,
    CampaignState,
    JointColumns,
    NewCampaign,
)
from service.cells import store as cells
from service.clock import utc_now
from service.db.models import BundleRow, CampaignRow, ParametersRow, PoseRow, ReadingRow
from service.errors import Conflict, Unusable
from service.jobs.queue import JobKind, JobQueue

_AVAILABLE = (CampaignKind.calibrate, CampaignKind.verify)
PURPOSE_CALIBRATE = "calibrate"


def create(session: Session, queue: JobQueue, wanted: NewCampaign) -> Accepted:
    """Store a campaign and the job that drives it."""
    if wanted.kind not in _AVAILABLE:
        raise Unusable(
            f"body kind: '{wanted.kind}' is not available in this version; "
            f"use {' or '.join(_AVAILABLE)}."
        )
    cell = cells.find(session, wanted.cell)
    if not is_armed(session, cell.name):
        raise Conflict(not_armed(cell.name))
    model = cells.settings_of(cell).robot.model
    robot = load_robot(model)
    if wanted.kind is CampaignKind.calibrate and isinstance(wanted.poses, int):
        require_enough(robot, wanted.poses)
    row = CampaignRow(
        cell=cell.name,
        kind=wanted.kind,
        state=CampaignState.queued,
        pose_count=wanted.poses if isinstance(wanted.poses, int) else len(wanted.poses),
        repeats=wanted.repeats,
        settle_s=wanted.settle_s,
        seed=0,
        robot_yaml=robot_path(model).read_text(encoding="utf-8"),
        joint_units=list(robot.joint_units),
        created=utc_now(),
    )
    if wanted.kind is CampaignKind.verify:
        row.parameters_version = _version_to_verify(session, cell.name)
        if not isinstance(wanted.poses, int):
            raise Unusable("body poses: a verification plans its own poses; give their number.")
    session.add(row)
    session.flush()
    row.seed = row.id if wanted.seed is None else wanted.seed
    if not isinstance(wanted.poses, int):
        joints = [_joints(robot, i, pose) for i, pose in enumerate(wanted.poses)]
        store_plan(session, row, joints, [PURPOSE_CALIBRATE] * len(joints))
    queue.enqueue(session, row.id, cell.name, JobKind.collect)
    return Accepted(id=row.id, state=CampaignState.queued)


def store_plan(
    session: Session, row: CampaignRow, joints: Sequence[list[float]], purposes: Sequence[str]
) -> None:
    """Write the poses that the robot is to visit, in this order."""
    session.add_all(
        PoseRow(campaign=row.id, idx=idx, commanded=q, purpose=purpose)
        for idx, (q, purpose) in enumerate(zip(joints, purposes, strict=True))
    )
    session.flush()


def page(session: Session, cell: str | None, before: int | None, limit: int) -> list[Campaign]:
    """Campaigns, newest first."""
    query = select(CampaignRow).order_by(CampaignRow.id.desc()).limit(limit)
    if cell is not None:
        query = query.where(CampaignRow.cell == cell)
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
        remaining_s=remaining,
        reason=row.reason,
        revision=row.revision,
        repeats=row.repeats,
        settle_s=row.settle_s,
        seed=row.seed,
        parameters_version=row.parameters_version,
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


def _version_to_verify(session: Session, cell: str) -> int:
    version = session.scalar(
        select(func.max(ParametersRow.version)).where(
            ParametersRow.cell == cell, ParametersRow.state.in_(("candidate", "released"))
        )
    )
    if version is None:
        raise Conflict(f"Cell '{cell}' has no parameters to verify; run a calibration first.")
    return version
