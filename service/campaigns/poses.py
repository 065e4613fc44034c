"""The poses of a campaign, and what became of each."""

from collections.abc import Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.campaigns.measurements import in_file_units
from service.campaigns.models import Pose, Poses, PoseState
from service.db.models import CampaignRow, PoseRow


def add_poses(
    session: Session,
    row: CampaignRow,
    joints: Sequence[list[float]],
    purposes: Sequence[str],
    sides: Sequence[list[int] | None] | None = None,
) -> int:
    """Write poses behind those that the plan has already, in this order; how many it has now.

    `sides` are the directions in which joints are asked to come; None leaves them to the campaign.
    """
    last = session.scalar(select(func.max(PoseRow.idx)).where(PoseRow.campaign == row.id))
    first = 0 if last is None else last + 1
    session.add_all(
        PoseRow(campaign=row.id, idx=idx, commanded=q, purpose=purpose, sides=asked)
        for idx, (q, purpose, asked) in enumerate(
            zip(joints, purposes, sides or [None] * len(joints), strict=True), start=first
        )
    )
    session.flush()
    return first + len(joints)


def poses(session: Session, row: CampaignRow, state: PoseState | None) -> Poses:
    """Return the poses of a campaign, those of one state or all."""
    query = select(PoseRow).where(PoseRow.campaign == row.id).order_by(PoseRow.idx)
    if state is not None:
        query = query.where(PoseRow.state == state)
    return Poses(
        campaign=row.id,
        poses=[_pose(pose, row.joint_units) for pose in session.scalars(query)],
    )


def _pose(pose: PoseRow, units: list[str]) -> Pose:
    commanded = in_file_units(pose.commanded, units)
    return Pose(
        pose=pose.idx,
        state=PoseState(pose.state),
        purpose=pose.purpose,
        attempts=pose.attempt,
        reason=pose.reason,
        joints={
            f"j{joint}_{unit}": q
            for joint, (q, unit) in enumerate(zip(commanded, units, strict=True), start=1)
        },
    )
