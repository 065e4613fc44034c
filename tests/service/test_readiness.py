"""Readiness is tried: without room, without a worker or without a writable file it is refused."""

import json
import logging
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import psycopg
import pytest
import structlog
from sqlalchemy import Engine, event
from sqlalchemy.exc import DBAPIError

from service.db.trouble import Trouble, trouble_of
from service.jobs.queue import Claim, JobKind
from service.jobs.queues import open_queue
from service.logs import about, set_up_logs
from tests.serving import serving


@pytest.fixture
def worker(database, settings) -> None:
    """A worker that has just given a sign of life."""
    open_queue(database, settings.lease_s).claim("w1")


def ready(client) -> tuple[int, dict[str, bool], dict[str, str]]:
    answer = client.get("../../readyz")
    found = answer.json()["checks"]
    passed = {check["name"]: check["passed"] for check in found}
    return answer.status_code, passed, {check["name"]: check["detail"] for check in found}


def test_a_service_with_database_worker_and_room_is_ready(client, worker):
    status, passed, _ = ready(client)
    assert (status, passed) == (200, {"disk": True, "database": True, "worker": True})


def test_without_a_worker_it_is_not_ready_and_says_how_to_start_one(client):
    status, passed, detail = ready(client)
    assert (status, passed["worker"]) == (503, False)
    assert "python -m service.jobs.worker" in detail["worker"]


def test_with_a_locked_database_it_is_not_ready(settings, worker):
    with (
        serving(settings.model_copy(update={"busy_s": 0.1})) as client,
        closing(sqlite3.connect(settings.database_url[10:], isolation_level=None)) as other,
    ):
        other.execute("BEGIN IMMEDIATE")
        status, passed, detail = ready(client)
    assert (status, passed["database"]) == (503, False)
    assert "does not answer" in detail["database"]


def test_with_too_little_room_it_is_not_ready(settings, worker):
    with serving(settings.model_copy(update={"disk_free_min_mb": 1e12})) as client:
        status, passed, detail = ready(client)
    assert (status, passed) == (503, {"disk": False, "database": True, "worker": True})
    assert "MB free" in detail["disk"]


def test_it_lives_whatever_is_missing(client):
    assert client.get("../../healthz").json() == {"status": "alive"}


def figures(client) -> dict[str, float]:
    lines = client.get("../../metrics").text.splitlines()
    return {
        line.rpartition(" ")[0]: float(line.rpartition(" ")[2]) for line in lines if line[0] != "#"
    }


def test_the_figures_count_requests_campaigns_jobs_workers_and_readings(client, cell, worker):
    body = {"cell": "c1", "kind": "calibrate", "poses": 40}
    assert client.post("campaigns", json=body).status_code == 202
    assert client.get("campaigns/99").status_code == 404
    shown = figures(client)
    assert shown['robocal_campaigns{state="queued"}'] == 1
    assert shown['robocal_jobs{state="queued"}'] == 1
    assert shown["robocal_readings_total"] == 0
    assert shown["robocal_workers_live"] == 1
    assert shown["robocal_disk_free_bytes"] > 0
    counted = [line for line in shown if line.startswith("robocal_http_requests_total{")]
    assert any('method="GET"' in line and 'status="404"' in line for line in counted)
    assert not any("campaigns/99" in line for line in counted)


def test_addresses_that_clients_make_up_add_one_figure_and_no_more(client):
    for number in range(20):
        client.get(f"../../nowhere/{number}")
    shown = figures(client)
    counted = [line for line in shown if line.startswith("robocal_http_requests_total{")]
    assert len(counted) == 1
    assert shown[counted[0]] == 20


def test_a_log_line_is_json_with_job_campaign_and_cell(capsys):
    claim = Claim(7, 3, "c1", JobKind.collect, 2, 0.0)
    root = logging.getLogger()
    before, level = root.handlers[:], root.level
    try:
        set_up_logs("worker")
        with about(claim):
            logging.getLogger("robocal.worker").warning("the tracker is %s", "silent")
        logging.getLogger("robocal.worker").warning("idle")
    finally:
        root.handlers[:], root.level = before, level
        structlog.contextvars.clear_contextvars()
    first, second = (json.loads(line) for line in capsys.readouterr().err.splitlines())
    assert first["event"] == "the tracker is silent"
    assert (first["job"], first["campaign"], first["cell"]) == (7, 3, "c1")
    assert (first["program"], first["level"]) == ("worker", "warning")
    assert "job" not in second


def test_a_damaged_database_is_called_so(settings):
    file = Path(settings.database_url.removeprefix("sqlite:///"))
    with serving(settings) as client:
        assert client.get("cells").status_code == 200
        with closing(sqlite3.connect(file)) as other:
            other.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        file.write_bytes(b"no longer a database" * 1000)
        answer = client.get("cells")
        assert answer.status_code == 503
        assert "is damaged" in answer.json()["detail"]
        assert "robocal restore" in answer.json()["detail"]
        status, passed, detail = ready(client)
    assert (status, passed["database"]) == (503, False)
    assert "is damaged" in detail["database"]


@pytest.fixture
def full_file() -> Iterator[None]:
    """SQLite's own limit: it then answers as it does on a full disk."""

    def limit(connection: sqlite3.Connection, record: object) -> None:
        connection.execute("PRAGMA max_page_count = 1")

    event.listen(Engine, "connect", limit)
    yield
    event.remove(Engine, "connect", limit)


def test_a_full_disk_is_called_so(settings, full_file):
    devices = {"driver": "mock", "address": "127.0.0.1:9"}
    with serving(settings) as client:
        for number in range(300):
            body = {
                "name": f"c{number}",
                "robot": {"model": "ur10e", **devices},
                "tracker": devices,
            }
            answer = client.post("cells", json=body)
            if answer.status_code != 201:
                break
        assert answer.status_code == 507
        assert answer.headers["content-type"] == "application/problem+json"
        assert "is full and nothing was stored" in answer.json()["detail"]
        assert client.get(f"cells/c{number}").status_code == 404
        if number:
            assert client.get("cells/c0").status_code == 200


@pytest.mark.parametrize(
    ("cause", "trouble"),
    [
        (psycopg.errors.DiskFull(), Trouble.disk_full),
        (psycopg.errors.IoError(), Trouble.disk_broken),
        (psycopg.errors.ReadOnlySqlTransaction(), Trouble.read_only),
        (psycopg.errors.NumericValueOutOfRange(), Trouble.unsuitable),
        (psycopg.errors.LockNotAvailable(), Trouble.busy),
        (psycopg.errors.AdminShutdown(), Trouble.busy),
    ],
)
def test_each_error_of_postgresql_gets_its_own_sentence(cause, trouble):
    assert trouble_of(DBAPIError("", None, cause)) is trouble
