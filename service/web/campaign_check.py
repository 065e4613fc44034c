"""What a person should know about a campaign while its form is being filled in."""

from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session

from robocal.robots.library import load_robot
from service.campaigns.enough import least_poses
from service.campaigns.models import ENDED, CampaignKind
from service.cells import store as cells
from service.db.models import CampaignRow
from service.parameters import store as parameters

SENSIBLE = 2
"""Times the fewest poses that determine the robot."""


@dataclass(frozen=True)
class Note:
    """One sentence about one field."""

    field: str
    key: str
    """Of its words."""
    values: dict[str, str | int]
    tone: str
    """`bad` where the service would refuse, `caution` or `good` otherwise."""


def notes(session: Session, cell: str, kind: CampaignKind, poses: int) -> list[Note]:
    """Check what no single field can say; raises `NotFound` for an unknown cell."""
    row = cells.find(session, cell)
    found = []
    if not row.armed:
        found.append(Note("cell", "check_not_armed", {"cell": cell}, "caution"))
    busy = session.scalar(
        select(CampaignRow.id)
        .where(CampaignRow.cell == cell, CampaignRow.state.not_in(ENDED))
        .order_by(CampaignRow.id)
        .limit(1)
    )
    if busy is not None:
        found.append(Note("cell", "check_busy", {"campaign": busy}, "caution"))
    if kind is CampaignKind.calibrate:
        found.append(_enough(cells.settings_of(row).robot.model, poses))
    elif kind is CampaignKind.verify:
        found.append(_to_verify(session, cell))
    elif kind is CampaignKind.health:
        found.append(_to_check(session, cell))
    return found


def _enough(model: str, poses: int) -> Note:
    least = least_poses(load_robot(model))
    values: dict[str, str | int] = {"robot": model, "least": least, "sensible": SENSIBLE * least}
    if poses < least:
        return Note("poses", "check_too_few", values, "bad")
    if poses < SENSIBLE * least:
        return Note("poses", "check_few", values, "caution")
    return Note("poses", "check_enough", values, "good")


def _to_verify(session: Session, cell: str) -> Note:
    versions = parameters.page(session, cell, None, None, 50).versions
    known = [version for version in versions if version.state != "superseded"]
    if not known:
        return Note("kind", "check_nothing_to_verify", {"cell": cell}, "bad")
    return Note("kind", "check_verifies", {"version": known[0].version}, "good")


def _to_check(session: Session, cell: str) -> Note:
    released = parameters.released(session, cell)
    if released is None:
        return Note("kind", "check_nothing_released", {"cell": cell}, "bad")
    return Note("kind", "check_health", {"version": released.version}, "good")
