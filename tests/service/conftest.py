"""The application in this process, on a database of its own; nothing else runs."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from service.db.engine import Database, open_database
from service.db.upgrade import upgrade_schema
from service.settings import Settings
from tests.credentials import BEARER
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
