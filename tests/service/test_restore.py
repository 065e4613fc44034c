"""A restore takes nothing away that it cannot replace."""

import shutil
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from threading import Event

import pytest
from sqlalchemy import text

from robocal.errors import BadInput
from service.backup.copying import copy_database
from service.backup.keeping import back_up, restore
from service.backup_lines import DISARMED
from service.clock import utc_now
from service.db.engine import Database, open_database
from service.db.models import CellRow
from service.jobs.queues import open_queue
from service.jobs.watch import Watch
from service.procedures.collect import collect
from service.procedures.job import Held, Job
from tests.service.filled_database import LEASE_S, contents, fill


def restored_into(target: Database, source: Database, file: Path) -> None:
    back_up(source, file, LEASE_S)
    restore(file, target, LEASE_S, replace=False)


def copied_into(target: Database, source: Database, file: Path) -> None:
    copy_database(source, target, LEASE_S)


def truncated(file: Path) -> None:
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])


def of_another_version(file: Path) -> None:
    changed_by(file, "UPDATE alembic_version SET version_num = '9999'")


def without_a_table(file: Path) -> None:
    changed_by(file, "DROP TABLE reading")


def with_half_a_document(file: Path) -> None:
    changed_by(file, "UPDATE cell SET document = '{'")


def with_an_orphan(file: Path) -> None:
    changed_by(file, "DELETE FROM campaign WHERE id = 2")


def changed_by(file: Path, statement: str) -> None:
    with closing(sqlite3.connect(file, isolation_level=None)) as backup:
        backup.execute(statement)


SPOILT = {
    Path.unlink: "no such file",
    lambda file: file.write_text("notes of a person " * 100): "cannot be read",
    lambda file: file.write_bytes(b""): "no database of robocal",
    truncated: "malformed",
    of_another_version: "another version",
    without_a_table: "no such table: reading",
    with_half_a_document: "not all of it can be read",
    with_an_orphan: "the database is damaged",
}


@pytest.mark.parametrize("spoil", SPOILT)
def test_a_backup_that_cannot_be_restored_leaves_everything_as_it_was(filled, tmp_path, spoil):
    file = tmp_path / "kept" / "backup.sqlite3"
    file.parent.mkdir()
    back_up(filled, file, LEASE_S)
    with filled.write() as session:
        session.add(CellRow(name="later", document={}, armed=False, created=utc_now()))
    there = contents(filled)
    spoil(file)
    with pytest.raises(BadInput, match=SPOILT[spoil]) as refused:
        restore(file, filled, LEASE_S, replace=True)
    assert refused.value.where == str(file)
    assert contents(filled) == there
    assert list(tmp_path.rglob("before-restore-*")) == []


def test_a_missing_backup_makes_no_folder(filled, tmp_path):
    with pytest.raises(BadInput, match="no such file"):
        restore(tmp_path / "nowhere" / "backup.sqlite3", filled, LEASE_S, replace=True)
    assert not (tmp_path / "nowhere").exists()


def test_the_file_of_the_database_itself_can_be_restored(database_url, tmp_path):
    file = Path(shutil.copy(database_url.removeprefix("sqlite:///"), tmp_path / "own.sqlite3"))
    own = open_database(f"sqlite:///{file}")
    with own.write() as session:
        session.add(CellRow(name="c", document={}, armed=False, created=utc_now()))
    there = contents(own)
    restore(file, own, LEASE_S, replace=True)
    assert contents(own) == there
    own.close()


def overwritten(file: Path) -> None:
    file.write_bytes(b"no longer a database" * 1000)


def with_a_ruined_page(file: Path) -> None:
    with file.open("rb+") as pages:
        pages.seek(file.stat().st_size * 2 // 3)
        pages.write(bytes(range(256)) * 64)


@pytest.fixture
def own(database_url, tmp_path):
    """A filled SQLite database in a file of its own, closed, and its backup."""
    file = Path(shutil.copy(database_url.removeprefix("sqlite:///"), tmp_path / "own.sqlite3"))
    opened = open_database(f"sqlite:///{file}")
    fill(opened)
    backup = tmp_path / "backup.sqlite3"
    back_up(opened, backup, LEASE_S)
    there = contents(opened, but="job")
    opened.close()
    return opened, file, backup, there


def with_a_ruined_letter(file: Path) -> None:
    content = file.read_bytes()
    file.write_bytes(content.replace(b"Zelle-", b"Zell\xff-"))


def of_a_later_format(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[44:48] = bytes([9, 9, 9, 9])
    file.write_bytes(content)


@pytest.mark.parametrize(
    "spoil",
    [
        overwritten,
        truncated,
        with_a_ruined_page,
        with_a_ruined_letter,
        with_half_a_document,
        of_a_later_format,
    ],
)
def test_a_damaged_database_is_put_aside_whole_and_the_backup_takes_its_place(own, spoil):
    database, file, backup, there = own
    spoil(file)
    ruin = file.read_bytes()
    with pytest.raises(BadInput, match="say --replace to put it aside") as refused:
        restore(backup, database, LEASE_S, replace=False)
    assert refused.value.where == str(file)
    assert file.read_bytes() == ruin
    _, aside = restore(backup, database, LEASE_S, replace=True)
    assert aside.read_bytes() == ruin
    assert contents(database, but="job") == there
    database.close()


def test_a_damaged_database_behind_a_link_is_put_aside_where_it_lies(own, tmp_path):
    _, file, backup, there = own
    (tmp_path / "link").mkdir()
    link = tmp_path / "link" / "own.sqlite3"
    link.symlink_to(file)
    truncated(file)
    linked = open_database(f"sqlite:///{link}")
    _, aside = restore(backup, linked, LEASE_S, replace=True)
    assert aside.parent == file.parent
    assert link.is_symlink()
    assert contents(linked, but="job") == there
    linked.close()


def test_of_two_restores_over_a_damaged_database_only_one_puts_it_aside(own):
    database, file, backup, there = own
    truncated(file)
    ruin = file.read_bytes()
    again = open_database(database.engine.url.render_as_string(hide_password=False))
    with ThreadPoolExecutor(2) as both:
        done = [
            both.submit(restore, backup, each, LEASE_S, replace=True) for each in (database, again)
        ]
        kept = sorted(future.result()[1].name for future in done)
    again.close()
    assert kept[0].startswith("before-restore-")
    assert kept[1].startswith("damaged-")
    assert (file.parent / kept[1]).read_bytes() == ruin
    assert contents(database, but="job") == there
    database.close()


def test_a_restore_over_a_damaged_database_that_is_broken_off_names_it(own, monkeypatch):
    database, file, backup, _ = own
    truncated(file)

    def broken_off(*args):
        raise KeyboardInterrupt

    monkeypatch.setattr("service.backup.keeping.copy_still", broken_off)
    with pytest.raises(BadInput, match=r"the damaged database is in .*damaged-.*; restore again"):
        restore(backup, database, LEASE_S, replace=True)
    database.close()


def test_a_locked_database_is_not_damaged(own, call, monkeypatch):
    _, file, backup, _ = own
    monkeypatch.setenv("ROBOCAL_DATABASE_URL", f"sqlite:///{file}")
    monkeypatch.setenv("ROBOCAL_BUSY_S", "0.1")
    with closing(sqlite3.connect(file, isolation_level=None)) as other:
        other.execute("PRAGMA journal_mode = DELETE")
        other.execute("BEGIN EXCLUSIVE")
        status, _, complaint = call("restore", backup, "--replace")
    assert (status, "database is locked" in complaint) == (2, True), complaint
    assert list(file.parent.glob("damaged-*")) == []


def test_a_damaged_database_that_still_knows_of_a_worker_stays_where_it_is(own):
    database, file, backup, _ = own
    open_queue(database, LEASE_S).claim("w")
    database.close()
    with_a_ruined_page(file)
    with pytest.raises(BadInput, match="1 workers are at work"):
        restore(backup, database, LEASE_S, replace=True)
    assert list(file.parent.glob("damaged-*")) == []
    database.close()


def test_what_was_there_is_kept_beside_the_database_or_where_it_has_no_folder_beside_the_backup(
    filled, tmp_path
):
    file = tmp_path / "kept" / "backup.sqlite3"
    file.parent.mkdir()
    back_up(filled, file, LEASE_S)
    _, before = restore(file, filled, LEASE_S, replace=True)
    assert before.parent == (tmp_path if filled.on_one_host else file.parent)


def test_a_restore_that_is_broken_off_names_the_file_with_what_was_there(filled, tmp_path):
    file = tmp_path / "backup.sqlite3"
    back_up(filled, file, LEASE_S)
    there = contents(filled)
    impatient = open_database(filled.engine.url.render_as_string(hide_password=False), busy_s=0.1)
    with filled.write() as session:
        session.execute(text("SELECT 1"))
        with pytest.raises(BadInput, match="the restore was broken off") as refused:
            restore(file, impatient, LEASE_S, replace=True)
    impatient.close()
    assert contents(filled) == there
    (before,) = tmp_path.glob("before-restore-*.sqlite3")
    assert f"what was there before is in {before}" in str(refused.value)
    kept = open_database(f"sqlite:///{before}")
    assert contents(kept, but="job") == {name: it for name, it in there.items() if name != "job"}
    kept.close()


@pytest.mark.parametrize("moved", [restored_into, copied_into])
def test_nothing_moves_in_a_copy_before_an_operator_has_armed_the_cell(filled, tmp_path, moved):
    with filled.write() as session:
        session.get_one(CellRow, "c").armed = True
    target = open_database(f"sqlite:///{tmp_path / 'target.sqlite3'}")
    moved(target, filled, tmp_path / "backup.sqlite3")
    queue = open_queue(target, LEASE_S)
    claim = queue.claim("w")
    with pytest.raises(Held, match="Cell 'c' is not armed"):
        collect(Job(target, queue, claim, Watch(queue, claim, lambda: None, Event(), 1.0)))
    target.close()


def test_restore_and_copy_say_that_no_cell_is_armed(filled, tmp_path, call, monkeypatch):
    url = filled.engine.url.render_as_string(hide_password=False)
    file = tmp_path / "backup.sqlite3"
    back_up(filled, file, LEASE_S)
    monkeypatch.setenv("ROBOCAL_DATABASE_URL", f"sqlite:///{tmp_path / 'target.sqlite3'}")
    for command in (("restore", file), ("copy-database", url, f"sqlite:///{tmp_path}/other")):
        status, said, _ = call(*command)
        assert (status, DISARMED in said) == (0, True), said
