"""The schema is made by migrations alone, and no migration loses a row, on either database."""

import multiprocessing
import sqlite3
import threading
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, select, text
from sqlalchemy.exc import DBAPIError, IntegrityError, OperationalError

from service.db.engine import Database, open_database
from service.db.models import Base, CellRow
from service.db.upgrade import alembic_config, is_ours, migrate, schema_revision, upgrade_schema

CHILD = """
INSERT INTO cell VALUES ('c', '{}', false, 'now');
INSERT INTO campaign (id, cell, kind, state, wish, reason, revision, pose_count, repeats, settle_s,
  seed, robot_yaml, joint_units, created)
  VALUES (1, 'c', 'calibrate', 'queued', '', '', 1, 1, 1, 0, 1, '', '[]', 'now');
INSERT INTO job (id, campaign, cell, kind, state, fence, lease_until, worker, reason, created)
  VALUES (1, 1, 'c', 'collect', 'queued', 0, 0, '', '', 'now');
INSERT INTO pose (campaign, idx, state, attempt, commanded, approach, purpose, reason)
  VALUES (1, 0, 'measured', 1, '[0]', '[1]', 'calibrate', '');
INSERT INTO reading VALUES (1, 1, 0, 0, 2, 1, 1, '[0]', '[0]', '[0,0,0]', NULL, 0, 1, NULL, '[1]',
  0.3, 0.5, 1, 1, 0, 1, 1, 1, 1, 'now', NULL);
"""

# A later migration that recreates a parent table in batch mode, as SQLite needs it.
NEXT = """
from alembic import op
import sqlalchemy as sa
revision = "9999"
down_revision = "{head}"


def how():
    return "always" if op.get_bind().dialect.name == "sqlite" else "never"


def upgrade():
    with op.batch_alter_table("campaign", recreate=how()) as batch:
        batch.add_column(sa.Column("remark", sa.Text(), nullable=True))
    {more}


def downgrade():
    with op.batch_alter_table("campaign", recreate=how()) as batch:
        batch.drop_column("remark")
"""


COMPARED = {"compare_type": True, "include_name": is_ours}
ROWS = ("cell", "campaign", "job", "pose", "reading")


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request, tmp_path):
    url = f"sqlite:///{tmp_path / 'migrated.sqlite3'}"
    if request.param == "postgresql":
        url = request.getfixturevalue("bare_postgresql_url")
    opened = open_database(url)
    yield opened
    opened.close()


@pytest.fixture
def file(tmp_path) -> Path:
    return tmp_path / "migrated.sqlite3"


@pytest.fixture
def sqlite_database(file):
    opened = open_database(f"sqlite:///{file}")
    yield opened
    opened.close()


def fill(database: Database) -> None:
    with database.write() as session:
        for statement in CHILD.split(";")[:-1]:
            session.connection().exec_driver_sql(statement)


def counts(database: Database) -> dict[str, int]:
    with database.read() as session:
        return {table: session.scalar(text(f"SELECT count(*) FROM {table}")) or 0 for table in ROWS}


def tables(database: Database) -> set[str]:
    return set(inspect(database.engine).get_table_names())


def later_config(database: Database, folder: Path, more: str = "pass"):
    """Alembic with one more migration after the committed ones."""
    config = alembic_config(database.engine)
    head = schema_revision(database.engine)
    folder.mkdir()
    (folder / "9999_next.py").write_text(NEXT.format(head=head, more=more))
    script = config.get_main_option("script_location")
    config.set_main_option("version_locations", f"{script}/versions:{folder}")
    return config


def upgraded(url: str) -> None:
    """Upgrade, as a process of its own."""
    opened = open_database(url)
    upgrade_schema(opened)
    opened.close()


def test_the_migrations_make_just_what_the_models_say(database):
    upgrade_schema(database)
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts=COMPARED)
        assert compare_metadata(context, Base.metadata) == []
    command.check(alembic_config(database.engine))


def test_the_migrations_are_one_chain(database):
    assert len(ScriptDirectory.from_config(alembic_config(database.engine)).get_heads()) == 1


def test_every_single_step_goes_down_and_up_again_with_rows(database):
    config = alembic_config(database.engine)
    upgrade_schema(database)
    fill(database)
    # The first step makes the tables that hold the rows.
    steps = len(list(ScriptDirectory.from_config(config).walk_revisions())) - 1
    for _ in range(steps):
        command.downgrade(config, "-1")
        assert counts(database) == dict.fromkeys(ROWS, 1)
    for _ in range(steps):
        command.upgrade(config, "+1")
        assert counts(database) == dict.fromkeys(ROWS, 1)
    upgrade_schema(database)


def test_up_down_up_leaves_nothing_behind_and_works_again(database):
    config = alembic_config(database.engine)
    upgrade_schema(database)
    fill(database)
    command.downgrade(config, "base")
    assert tables(database) == {"alembic_version"}
    assert not set(inspect(database.engine).get_schema_names()) & {"procrastinate"}
    command.upgrade(config, "head")
    assert counts(database) == dict.fromkeys(ROWS, 0)
    fill(database)
    assert counts(database) == dict.fromkeys(ROWS, 1)


def test_an_upgrade_of_an_upgraded_database_changes_nothing(database, tmp_path):
    upgrade_schema(database)
    fill(database)
    upgrade_schema(database)
    assert counts(database) == dict.fromkeys(ROWS, 1)
    assert list(tmp_path.glob("*.before-*")) == []


def test_several_processes_may_upgrade_at_once(database):
    url = database.engine.url.render_as_string(hide_password=False)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        for done in [pool.submit(upgraded, url) for _ in range(2)]:
            done.result()
    fill(database)
    assert counts(database) == dict.fromkeys(ROWS, 1)


def test_a_new_file_that_another_process_writes_is_waited_for(tmp_path):
    file = tmp_path / "new.sqlite3"
    with closing(sqlite3.connect(file, isolation_level=None, check_same_thread=False)) as other:
        other.execute("CREATE TABLE theirs (x)")
        other.execute("BEGIN IMMEDIATE")
        opened = open_database(f"sqlite:///{file}")
        letting_go = threading.Timer(0.3, other.execute, ["COMMIT"])
        letting_go.start()
        assert schema_revision(opened.engine) is None
        letting_go.join()
        opened.close()


def test_a_new_file_that_stays_locked_is_given_up(tmp_path):
    file = tmp_path / "new.sqlite3"
    with closing(sqlite3.connect(file, isolation_level=None)) as other:
        other.execute("CREATE TABLE theirs (x)")
        other.execute("BEGIN IMMEDIATE")
        opened = open_database(f"sqlite:///{file}", busy_s=0.1)
        with pytest.raises(OperationalError, match="locked"):
            schema_revision(opened.engine)
        opened.close()
        other.execute("COMMIT")


def test_recreating_a_parent_table_keeps_its_children_up_and_down(database, tmp_path):
    upgrade_schema(database)
    fill(database)
    config = later_config(database, tmp_path / "later")
    command.upgrade(config, "heads")
    assert counts(database) == dict.fromkeys(ROWS, 1)
    command.downgrade(config, "-1")
    assert counts(database) == dict.fromkeys(ROWS, 1)
    command.upgrade(config, "heads")
    assert counts(database) == dict.fromkeys(ROWS, 1)


def test_a_migration_that_orphans_rows_is_undone_whole(database, tmp_path):
    upgrade_schema(database)
    fill(database)
    before = schema_revision(database.engine)
    orphan = "op.execute(\"DELETE FROM cell WHERE name = 'c'\")"
    config = later_config(database, tmp_path / "later", orphan)
    with pytest.raises((RuntimeError, IntegrityError), match=r"nothing was changed|foreign key"):
        command.upgrade(config, "heads")
    assert schema_revision(database.engine) == before
    assert counts(database) == dict.fromkeys(ROWS, 1)
    columns = {column["name"] for column in inspect(database.engine).get_columns("campaign")}
    assert "remark" not in columns


def test_a_reading_is_never_changed_nor_deleted(database):
    upgrade_schema(database)
    fill(database)
    for change in ("UPDATE reading SET spread = 1", "DELETE FROM reading"):
        with pytest.raises(DBAPIError, match="never changed"), database.write() as session:
            session.execute(text(change))
    assert counts(database)["reading"] == 1


def test_an_existing_file_is_copied_before_it_is_migrated(sqlite_database, file, tmp_path):
    database = sqlite_database
    upgrade_schema(database)
    fill(database)
    config = later_config(database, tmp_path / "later")
    old = schema_revision(database.engine)
    migrate(database, config)
    assert schema_revision(database.engine) == "9999"
    copy = open_database(f"sqlite:///{file}.before-{old}")
    assert counts(copy) == dict.fromkeys(ROWS, 1)
    copy.close()


def test_foreign_keys_are_on_again_after_a_migration(sqlite_database):
    upgrade_schema(sqlite_database)
    with sqlite_database.read() as session:
        assert session.connection().exec_driver_sql("PRAGMA foreign_keys").scalar() == 1


def test_a_cell_that_was_faster_than_a_stop_allows_is_slowed_down(database):
    config = alembic_config(database.engine)
    command.upgrade(config, "0006")
    with database.write() as session:
        session.execute(
            text("INSERT INTO cell (name, document, armed, created) VALUES (:n, :d, false, '')"),
            [
                {"n": "fast", "d": '{"limits": {"speed_deg_s": 180.0, "floor_mm": 5}}'},
                {"n": "slow", "d": '{"limits": {"speed_deg_s": 30.0}}'},
            ],
        )
    command.upgrade(config, "head")
    with database.read() as session:
        speeds = {
            row.name: row.document["limits"] for row in session.scalars(select(CellRow)).all()
        }
    assert speeds["fast"] == {"speed_deg_s": 90.0, "floor_mm": 5}
    assert speeds["slow"] == {"speed_deg_s": 30.0}
