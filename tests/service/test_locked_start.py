"""A start on a database that another program keeps locked: it waits only where it has to write."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from service.access import keys, people
from service.access.scopes import Scope
from tests.credentials import KEY, PASSWORD

ENTRY = "from service.cli import main; main()"
ROOT = Path(__file__).parents[2]
DEADLINE_S = 60.0


@contextmanager
def locked(url: str) -> Iterator[sqlite3.Connection]:
    """Another program in the middle of a long change."""
    file = url.removeprefix("sqlite:///")
    with closing(sqlite3.connect(file, isolation_level=None)) as other:
        other.execute("BEGIN IMMEDIATE")
        yield other


@contextmanager
def starting(url: str) -> Iterator[subprocess.Popen[str]]:
    """`robocal serve` without a worker, which gives a lock a tenth of a second."""
    process = subprocess.Popen(
        [sys.executable, "-c", ENTRY, "serve", "--port", "0", "--no-worker"],
        env=os.environ | {"ROBOCAL_DATABASE_URL": url, "ROBOCAL_BUSY_S": "0.1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=ROOT,
    )
    with process:
        try:
            yield process
        finally:
            process.kill()


def heard(process: subprocess.Popen[str], word: str) -> None:
    """Read the log until the word comes; fails when the program ends without it."""
    said = ""
    for line in process.stderr:
        said += line
        if word in line:
            return
    raise AssertionError(said)


@pytest.fixture(params=["up to date", "new"])
def url(request, database_url, tmp_path) -> str:
    return database_url if request.param == "up to date" else f"sqlite:///{tmp_path}/new.sqlite3"


def test_a_start_waits_for_a_locked_database_and_says_so(url):
    with locked(url) as other, starting(url) as process:
        heard(process, "another program keeps the database locked")
        other.execute("ROLLBACK")
        assert json.loads(process.stdout.readline())["ready"] is True


def test_a_start_that_waits_for_a_locked_database_can_be_ended(url):
    with locked(url), starting(url) as process:
        heard(process, "another program keeps the database locked")
        process.terminate()
        assert process.wait(DEADLINE_S) == -signal.SIGTERM


def test_a_start_with_nothing_to_write_asks_for_no_lock(database, database_url):
    with database.write() as session:
        keys.set_bootstrap(session, KEY)
        people.set_password(
            session, people.create(session, "eva", Scope.engineer, "test"), PASSWORD
        )
    with locked(database_url), starting(database_url) as process:
        assert json.loads(process.stdout.readline())["ready"] is True
        process.send_signal(signal.SIGTERM)
        assert "locked" not in process.stderr.read()


def test_a_link_for_the_first_engineer_is_ended_by_the_next_start_when_somebody_can_log_in(
    database,
):
    with database.write() as session:
        assert people.first_link(session) is not None
        people.set_password(
            session, people.create(session, "eva", Scope.engineer, "test"), PASSWORD
        )
    with database.write() as session:
        assert people.needs_first_link(session)
        assert people.first_link(session) is None
        assert not people.needs_first_link(session)
