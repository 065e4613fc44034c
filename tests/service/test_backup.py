"""Databases are copied, backed up and restored whole, between both kinds, while they are in use."""

import shutil
import sqlite3
import threading
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import func, select, text

from robocal.errors import BadInput
from service.backup.copying import copy_database
from service.backup.keeping import back_up, restore
from service.clock import utc_now
from service.db.engine import open_database
from service.db.models import CellRow, JobRow, ReadingRow
from service.jobs.queues import open_queue
from tests.service.filled_database import LEASE_S, READINGS, campaign, contents


@pytest.fixture
def target(request, filled, tmp_path, empty_database):
    """An empty database of the other kind."""
    if filled.on_one_host:
        url = request.getfixturevalue("second_postgresql_url")
    else:
        url = f"sqlite:///{shutil.copy(empty_database, tmp_path / 'target.sqlite3')}"
    database = open_database(url)
    yield database
    database.close()


def test_everything_arrives_in_the_other_kind_of_database(filled, target):
    copied = copy_database(filled, target, LEASE_S)
    assert {table.name: table.rows for table in copied}["reading"] == READINGS
    # Open jobs change hands; everything else is what it was.
    assert contents(target, but="job") == contents(filled, but="job")
    with target.read() as session:
        approach = session.scalars(select(ReadingRow).where(ReadingRow.repeat == 1)).one()
        assert approach.position == [1.0 / 3.0, 2e-9, -0.0]
        assert approach.orientation is None


def test_an_open_job_goes_on_in_the_new_database_and_numbers_are_new(filled, target):
    taken = open_queue(filled, LEASE_S).claim("old")
    copy_database(filled, target, LEASE_S)
    claim = open_queue(target, LEASE_S).claim("new")
    assert (claim.job, claim.campaign) == (taken.job, 1)
    assert claim.fence > taken.fence
    with target.write() as session:
        row = campaign(0, None)
        row.id = None
        session.add(row)
        session.flush()
        assert row.id == 3


def test_a_copy_into_a_database_that_holds_something_is_refused(filled, target):
    with target.write() as session:
        session.add(CellRow(name="mine", document={}, armed=False, created=utc_now()))
    with pytest.raises(BadInput, match="copy into an empty one"):
        copy_database(filled, target, LEASE_S)
    with target.read() as session:
        assert session.scalar(select(func.count()).select_from(ReadingRow)) == 0


def test_a_backup_is_restored_into_the_other_kind_of_database(filled, target, tmp_path):
    file = tmp_path / "backup.sqlite3"
    kept = back_up(filled, file, LEASE_S)
    assert {table.name: table.rows for table in kept}["reading"] == READINGS
    restored, before = restore(file, target, LEASE_S, replace=False)
    assert before is None
    assert len(restored) == len(kept)
    assert contents(target, but="job") == contents(filled, but="job")
    assert sorted(path.name for path in tmp_path.glob("backup*")) == ["backup.sqlite3"]


def test_a_restore_replaces_only_when_told_and_keeps_what_was_there(filled, tmp_path):
    file = tmp_path / "backup.sqlite3"
    back_up(filled, file, LEASE_S)
    at_the_backup = contents(filled, but="job")
    with filled.write() as session:
        session.add(CellRow(name="later", document={}, armed=False, created=utc_now()))
    later = contents(filled, but="job")
    with pytest.raises(BadInput, match="--replace"):
        restore(file, filled, LEASE_S, replace=False)
    assert contents(filled, but="job") == later
    _, before = restore(file, filled, LEASE_S, replace=True)
    assert contents(filled, but="job") == at_the_backup
    kept = open_database(f"sqlite:///{before}")
    assert contents(kept, but="job") == later
    kept.close()


def test_a_restore_under_a_workers_hands_is_refused(filled, tmp_path):
    file = tmp_path / "backup.sqlite3"
    back_up(filled, file, LEASE_S)
    open_queue(filled, LEASE_S).claim("w1")
    with pytest.raises(BadInput, match="stop them before a restore"):
        restore(file, filled, LEASE_S, replace=True)


def test_a_backup_during_writes_is_one_moment_of_the_database(filled, tmp_path):
    """Each transaction adds a cell and its campaign: a backup has both or neither."""
    over = threading.Event()

    def write() -> None:
        number = 10
        while not over.is_set():
            with filled.write() as session:
                session.add(CellRow(name=f"n{number}", document={}, armed=False, created=utc_now()))
                session.flush()
                session.add(campaign(number, f"n{number}"))
            number += 1

    thread = threading.Thread(target=write)
    thread.start()
    try:
        for number in range(3):
            back_up(filled, tmp_path / f"{number}.sqlite3", LEASE_S)
    finally:
        over.set()
        thread.join()
    sizes = []
    for number in range(3):
        with closing(sqlite3.connect(tmp_path / f"{number}.sqlite3")) as kept:
            count = "SELECT count(*) FROM"
            sizes.append(kept.execute(f"{count} cell").fetchone()[0])
            assert kept.execute(f"{count} campaign").fetchone()[0] == sizes[-1] + 1
    assert sizes == sorted(sizes)
    assert sizes[-1] > sizes[0]


def test_a_damaged_or_missing_backup_is_refused_in_one_line(
    tmp_path, database_url, call, monkeypatch
):
    monkeypatch.setenv("ROBOCAL_DATABASE_URL", database_url)
    broken = tmp_path / "broken.sqlite3"
    broken.write_bytes(b"this is no database, and long enough to be looked at as one" * 50)
    for file, word in ((broken, "cannot be read"), (tmp_path / "nowhere.sqlite3", "no such file")):
        status, _, complaint = call("restore", file)
        assert (status, complaint.count("\n")) == (2, 1)
        assert word in complaint


def test_the_commands_back_up_and_restore_what_the_settings_name(
    filled, tmp_path, call, monkeypatch, second_postgresql_url
):
    url = filled.engine.url.render_as_string(hide_password=False)
    monkeypatch.setenv("ROBOCAL_DATABASE_URL", url)
    file = tmp_path / "kept.sqlite3"
    status, printed, _ = call("backup", file)
    assert status == 0
    assert f"reading          {READINGS:8d}" in printed
    assert call("backup", file)[0] == 2
    status, again, _ = call("restore", file, "--replace")
    assert status == 0
    assert "what was there before is in" in again
    status, moved, _ = call("copy-database", url, second_postgresql_url)
    assert status == 0
    assert "every row arrived as it was sent" in moved
    readings = [line for line in printed.splitlines() if line.startswith("reading")]
    assert readings[0] in again
    assert readings[0] in moved


def test_readings_cannot_be_changed_after_a_restore(filled, tmp_path):
    file: Path = tmp_path / "backup.sqlite3"
    back_up(filled, file, LEASE_S)
    restore(file, filled, LEASE_S, replace=True)
    with filled.read() as session:
        assert session.scalar(select(func.count()).select_from(JobRow)) == 1
    with pytest.raises(Exception, match="never changed"), filled.write() as session:
        session.execute(text("UPDATE reading SET spread = 1"))


def test_a_place_where_no_backup_can_be_written_is_named_and_not_the_database(filled, tmp_path):
    (tmp_path / "text").touch()
    for place, cause in (
        ("nowhere/x.sqlite3", "No such file or directory"),
        ("text/x.sqlite3", "Not a directory"),
        ("x" * 300, "File name too long"),
    ):
        with pytest.raises(BadInput, match=f"it cannot be written.*{cause}") as refused:
            back_up(filled, tmp_path / place, LEASE_S)
        assert refused.value.where == str(tmp_path / place)
    assert not (tmp_path / "nowhere").exists()


def test_a_backup_without_room_says_so_and_leaves_no_half_file(filled, tmp_path):
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    folder = tmp_path / "kept"
    folder.mkdir()
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, before[1]))
    try:
        with pytest.raises(BadInput, match="it cannot be written") as refused:
            back_up(filled, folder / "x.sqlite3", LEASE_S)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert refused.value.where.startswith(str(folder / "x.sqlite3"))
    assert list(folder.iterdir()) == []
