"""The application in this process, on a database of its own; nothing else runs."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from threading import Event

import httpx
import pytest

from service.clock import utc_now
from service.db.engine import Database, open_database
from service.db.models import CampaignRow, CellRow, PoseRow
from service.db.upgrade import upgrade_schema
from service.jobs.queue import JobKind
from service.jobs.table_queue import TableQueue
from service.jobs.watch import Watch
from service.procedures.job import Job
from service.settings import Settings
from tests.credentials import BEARER
from tests.service.filled_database import fill
from tests.serving import PATIENCE_S, serving


@pytest.fixture(scope="session")
def empty_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An upgraded database to copy: migrating it for every test takes longer than the tests."""
    file = tmp_path_factory.mktemp("empty") / "empty.sqlite3"
    opened = open_database(f"sqlite:///{file}")
    upgrade_schema(opened)
    opened.close()
    return file


@pytest.fixture
def database_url(tmp_path: Path, empty_database: Path) -> str:
    file = shutil.copy(empty_database, tmp_path / "test.sqlite3")
    return f"sqlite:///{file}"


@pytest.fixture
def settings(database_url: str) -> Settings:
    return Settings(database_url=database_url)


@pytest.fixture
def database(settings: Settings) -> Iterator[Database]:
    opened = open_database(settings.database_url)
    yield opened
    opened.close()


@pytest.fixture(params=["sqlite", "postgresql"])
def filled(request: pytest.FixtureRequest) -> Iterator[Database]:
    """A database of either kind that holds something."""
    setting = "database_url" if request.param == "sqlite" else "postgresql_url"
    opened = open_database(request.getfixturevalue(setting))
    fill(opened)
    yield opened
    opened.close()


@pytest.fixture
def client(settings: Settings) -> Iterator[httpx.Client]:
    with serving(settings) as opened:
        yield opened


@pytest.fixture
def site(client: httpx.Client) -> Iterator[httpx.Client]:
    """The same service from its root: the pages."""
    with httpx.Client(
        base_url=client.base_url.join("/"), headers=BEARER, timeout=PATIENCE_S
    ) as opened:
        yield opened


@pytest.fixture
def cell(client: httpx.Client) -> dict:
    """An armed cell whose devices are nowhere."""
    body = {
        "name": "c1",
        "robot": {"model": "ur10e", "driver": "mock", "address": "127.0.0.1:9"},
        "tracker": {"driver": "mock", "address": "127.0.0.1:9"},
    }
    assert client.post("cells", json=body).status_code == 201
    assert client.post("cells/c1/arm").status_code == 200
    return body


@pytest.fixture
def job(database) -> Job:
    """A claimed campaign of two poses of a two-joint robot, each to be visited twice."""
    queue = TableQueue(database, lease_s=60)
    with database.write() as session:
        session.add(CellRow(name="c", document={}, armed=True, created=utc_now()))
        session.flush()
        campaign = CampaignRow(id=1, cell="c", kind="calibrate", state="running", pose_count=2)
        campaign.repeats, campaign.settle_s, campaign.seed = 2, 0.1, 1
        campaign.robot_yaml, campaign.joint_units, campaign.created = "", ["deg"] * 2, utc_now()
        session.add(campaign)
        session.flush()
        for idx, commanded in enumerate(([0.5, -0.5], [0.5, 0.5])):
            session.add(PoseRow(campaign=1, idx=idx, commanded=commanded, purpose="calibrate"))
        queue.enqueue(session, 1, "c", JobKind.collect)
    claim = queue.claim("w")
    return Job(database, queue, claim, Watch(queue, claim, lambda: None, Event(), 1.0))
