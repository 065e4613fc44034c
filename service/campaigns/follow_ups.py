"""Follow-ups: campaigns that drive the poses which a diagnosis asks for, round after round.

All rounds are one campaign of one arming. Its bundle is pooled with those before it, so that each
diagnosis sees everything that was measured of the question.
"""

import json
from dataclasses import dataclass

from sqlalchemy.orm import Session

from service.campaigns import life, results
from service.campaigns.lineage import MOST_CAMPAIGNS, lineage
from service.campaigns.models import NewCampaign
from service.campaigns.poses import add_poses
from service.campaigns.results import ResultKind
from service.db.models import BundleRow, CampaignRow, ResultFileRow
from service.errors import Conflict, Unusable

NEXT_JOINTS = "next_joints.json"
PURPOSE = "follow_up"


@dataclass(frozen=True)
class FollowUpPoses:
    """What a diagnosis wants to see next [rad or m], with the side that each joint comes from."""

    joints: list[list[float]]
    approach: list[list[float]]

    def text(self) -> str:
        """As it is stored beside the result."""
        return json.dumps({"joints": self.joints, "approach": self.approach})

    def first(self, count: int) -> "FollowUpPoses":
        """Return the most telling ones; they are in that order."""
        return FollowUpPoses(self.joints[:count], self.approach[:count])


def aim(session: Session, row: CampaignRow, wanted: NewCampaign) -> FollowUpPoses:
    """Note what a follow-up is about; the poses of its first round.

    Raises
    ------
    Conflict
        If that campaign has no open question, or cannot be pooled with.
    Unusable
        If the request does not say which campaign it follows, or states a payload where that
        campaign has none.
    """
    if wanted.follows is None:
        raise Unusable("body follows: give the number of the campaign whose diagnosis it is about.")
    before = life.find(session, wanted.follows)
    if before.cell != row.cell or session.get(BundleRow, before.id) is not None:
        raise Conflict(
            f"Campaign {before.id} was not measured in cell '{row.cell}': its tracker stands "
            f"elsewhere. Drive its next_poses.csv there, and import all rows as one bundle."
        )
    if len(lineage(session, before)) >= MOST_CAMPAIGNS:
        raise Conflict(f"Campaign {before.id} ends a chain of {MOST_CAMPAIGNS} follow-ups already.")
    if wanted.payload_kg is not None and before.payload_kg is None:
        raise Unusable(
            f"body payload_kg: campaign {before.id} does not state what the arm held, so what "
            "another payload changes cannot be told. Leave it out, or calibrate with payload_kg."
        )
    row.follows = before.id
    row.rounds = wanted.rounds or 1
    if isinstance(wanted.poses, list):
        return FollowUpPoses([], [])
    poses = asked_poses(session, before.id)
    if not poses.joints:
        raise Conflict(
            f"The diagnosis of campaign {before.id} leaves no choice between causes: no poses are "
            "asked for. Give own poses to measure more all the same."
        )
    return poses if wanted.poses is None else poses.first(wanted.poses)


def asked_poses(session: Session, campaign: int) -> FollowUpPoses:
    """Return what the newest diagnosis of a campaign asks for; raises `NotFound` without one."""
    diagnosis = results.newest(session, campaign, ResultKind.diagnosis)
    stored = session.get_one(ResultFileRow, (diagnosis.id, NEXT_JOINTS))
    return FollowUpPoses(**json.loads(stored.content))


def append_poses(session: Session, row: CampaignRow, asked: FollowUpPoses) -> None:
    """Add one round to the plan."""
    sides = [[round(side) for side in pose] for pose in asked.approach]
    row.pose_count = add_poses(session, row, asked.joints, [PURPOSE] * len(asked.joints), sides)
