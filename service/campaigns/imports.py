"""A bundle measured elsewhere becomes a campaign whose readings are in already."""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from sqlalchemy.orm import Session

from robocal.errors import RobocalError
from robocal.formats.bundle import Bundle
from robocal.robots.library import load_robot
from service.campaigns.measurements import zipped
from service.campaigns.models import Accepted, CampaignKind, CampaignState
from service.campaigns.unzip import UnpackLimits, unpack
from service.cells import store as cells
from service.clock import utc_now
from service.db.models import BundleRow, CampaignRow
from service.errors import Unusable
from service.jobs.queue import JobKind, JobQueue
from service.sound_bundle import read_sound


@dataclass(frozen=True)
class CheckedBundle:
    """An upload that can be analysed."""

    archive: bytes
    """A .zip of the bundle's files alone."""
    bundle: Bundle


def checked(upload: IO[bytes], limits: UnpackLimits) -> CheckedBundle:
    """Unpack and read an upload; raises `Unusable` with the one sentence that names the fault."""
    files = unpack(upload, limits)
    with tempfile.TemporaryDirectory(prefix="robocal-import-") as name:
        folder = Path(name)
        write_files(folder, files)
        try:
            return CheckedBundle(zipped(files), read_sound(folder))
        except RobocalError as error:
            raise Unusable(str(error).replace(f"{folder}/", "")) from error


def write_files(folder: Path, files: dict[str, bytes]) -> None:
    """Lay the files of a bundle into a folder; names in sub-folders are no part of a bundle."""
    for name, content in files.items():
        if "/" in name:
            raise Unusable(f"The .zip holds '{name}' in a sub-folder; a bundle is one flat folder.")
        (folder / name).write_bytes(content)


def store(
    session: Session, queue: JobQueue, checked_bundle: CheckedBundle, cell: str | None
) -> Accepted:
    """Store the bundle and the job that analyses it; nothing is driven."""
    bundle = checked_bundle.bundle
    if cell is not None:
        _require_same_joints(session, cell, bundle)
    row = CampaignRow(
        cell=cell,
        kind=CampaignKind.calibrate,
        state=CampaignState.queued,
        pose_count=len(bundle.measurements),
        repeats=1,
        settle_s=0.0,
        seed=0,
        robot_yaml="",
        joint_units=list(bundle.robot.joint_units),
        created=utc_now(),
    )
    session.add(row)
    session.flush()
    session.add(BundleRow(campaign=row.id, content=checked_bundle.archive))
    queue.enqueue(session, row.id, cell, JobKind.analyse)
    return Accepted(id=row.id, state=CampaignState.queued)


def _require_same_joints(session: Session, cell: str, bundle: Bundle) -> None:
    model = cells.settings_of(cells.find(session, cell)).robot.model
    wanted, given = load_robot(model).joint_units, bundle.robot.joint_units
    if wanted != given:
        raise Unusable(
            f"The bundle's robot '{bundle.robot.name}' has {len(given)} joints "
            f"({', '.join(given)}), cell '{cell}' has '{model}' with {len(wanted)} "
            f"({', '.join(wanted)}); import it without a cell or into the right one."
        )
