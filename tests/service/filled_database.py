"""A database with a campaign in a worker's hands, its readings, and awkward values."""

from service.backup.rows import summary, tables
from service.clock import utc_now
from service.db.engine import Database
from service.db.models import AnswerRow, BundleRow, CampaignRow, CellRow, PoseRow, ReadingRow
from service.jobs.queue import JobKind
from service.jobs.queues import open_queue

LEASE_S = 10.0
READINGS = 503
"""More than are copied at once."""


def fill(database: Database) -> None:
    """Store two campaigns, the first of which waits for a worker."""
    with database.write() as session:
        document = {"name": "Zelle-ö", "nothing": None, "list": [1, 2.5, 1e-300, "\u4e2d"]}
        session.add(CellRow(name="c", document=document, armed=False, created=utc_now()))
        session.flush()
        session.add(campaign(1, "c"))
        session.add(campaign(2, None))
        session.flush()
        session.add(BundleRow(campaign=2, content=bytes(range(256)) * 40))
        session.add(PoseRow(campaign=1, idx=0, commanded=[0.1 + 0.2, -1e-17], purpose="calibrate"))
        session.add(
            AnswerRow(key="k", request_sha256="0", status=201, body="{}", created=utc_now())
        )
        session.flush()
        session.add_all(reading(number) for number in range(READINGS))
        open_queue(database, LEASE_S).enqueue(session, 1, "c", JobKind.collect)


def contents(database: Database, *, but: str = "") -> dict[str, tuple[int, str]]:
    """Number and hash of the rows of every table."""
    with database.read() as session:
        found = [summary(session, table) for table in tables() if table.name != but]
    return {table.name: (table.rows, table.sha256) for table in found}


def campaign(number: int, cell: str | None) -> CampaignRow:
    return CampaignRow(
        id=number,
        cell=cell,
        kind="calibrate",
        state="running",
        pose_count=1,
        repeats=READINGS,
        settle_s=0.3,
        seed=2**31 - 1,
        robot_yaml="",
        joint_units=["deg"],
        created=utc_now(),
    )


def reading(number: int) -> ReadingRow:
    row = ReadingRow(campaign=1, idx=0, repeat=number, revision=number, attempt=1, fence=1)
    row.joints, row.commanded, row.position = [0.1 * number], [0.0], [1.0 / 3.0, 2e-9, -0.0]
    row.orientation = None if number % 2 else [1.0, 0.0, 0.0, 0.0]
    row.spread, row.shots, row.approach, row.speed = 1e-6 * number, 3, [-1], 0.25
    row.settle_s = row.robot_time_s = row.tracker_time_s = row.t_s = number / 7.0
    row.motion_s = row.settling_s = row.measuring_s = row.overhead_s = 0.1
    row.created = utc_now()
    return row
