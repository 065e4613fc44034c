"""The schema is made by migrations alone, and no migration loses a row."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from alembic import command
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext

from service.db.engine import Database, open_database
from service.db.models import Base
from service.db.upgrade import alembic_config, migrate, schema_revision, upgrade_schema

CHILD = """
INSERT INTO cell VALUES ('c', '{}', 0, 'now');
INSERT INTO campaign (id, cell, kind, state, wish, reason, revision, pose_count, repeats, settle_s,
  seed, robot_yaml, joint_units, created)
  VALUES (1, 'c', 'calibrate', 'queued', '', '', 1, 1, 1, 0, 1, '', '[]', 'now');
INSERT INTO job (id, campaign, cell, kind, state, fence, lease_until, worker, reason, created)
  VALUES (1, 1, 'c', 'collect', 'queued', 0, 0, '', '', 'now');
INSERT INTO pose VALUES (1, 0, 'measured', 1, '[0]', '[1]', 'calibrate');
INSERT INTO reading VALUES (1, 1, 0, 0, 2, 1, 1, '[0]', '[0]', '[0,0,0]', NULL, 0, 1, NULL, '[1]',
  0.3, 0.5, 1, 1, 0, 1, 1, 1, 1, 'now');
"""

# A later migration that recreates a parent table in batch mode, as SQLite needs it.
NEXT = """
from alembic import op
import sqlalchemy as sa
revision = "9999"
down_revision = "{head}"


def upgrade():
    with op.batch_alter_table("campaign", recreate="always") as batch:
        batch.add_column(sa.Column("remark", sa.Text(), nullable=True))
    {more}


def downgrade():
    with op.batch_alter_table("campaign", recreate="always") as batch:
        batch.drop_column("remark")
"""


@pytest.fixture
def file(tmp_path) -> Path:
    return tmp_path / "migrated.sqlite3"


@pytest.fixture
def database(file):
    opened = open_database(f"sqlite:///{file}")
    yield opened
    opened.close()


def fill(file: Path) -> None:
    with closing(sqlite3.connect(file)) as connection:
        connection.execute("PRAGMA foreign_keys = ON")
        connection.executescript(CHILD)


def counts(file: Path) -> dict[str, int]:
    tables = ("cell", "campaign", "job", "pose", "reading")
    with closing(sqlite3.connect(file)) as connection:
        return {
            table: connection.execute(f"SELECT count(*) FROM {table}").fetchone()[0]
            for table in tables
        }


def tables(file: Path) -> set[str]:
    with closing(sqlite3.connect(file)) as connection:
        rows = connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
        return {name for (name,) in rows}


def later_config(database: Database, folder: Path, more: str = "pass"):
    """Alembic with one more migration after the committed ones."""
    config = alembic_config(database.engine)
    head = schema_revision(database.engine)
    folder.mkdir()
    (folder / "9999_next.py").write_text(NEXT.format(head=head, more=more))
    script = config.get_main_option("script_location")
    config.set_main_option("version_locations", f"{script}/versions:{folder}")
    return config


def test_the_migrations_make_just_what_the_models_say(database):
    upgrade_schema(database)
    with database.engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []
    command.check(alembic_config(database.engine))


def test_up_down_up_leaves_nothing_behind_and_works_again(database, file):
    config = alembic_config(database.engine)
    upgrade_schema(database)
    fill(file)
    command.downgrade(config, "base")
    assert tables(file) == {"alembic_version"}
    command.upgrade(config, "head")
    assert counts(file) == dict.fromkeys(counts(file), 0)
    fill(file)
    assert counts(file) == dict.fromkeys(counts(file), 1)


def test_an_upgrade_of_an_upgraded_database_changes_nothing(database, file):
    upgrade_schema(database)
    fill(file)
    upgrade_schema(database)
    assert counts(file) == dict.fromkeys(counts(file), 1)
    assert list(file.parent.glob("*.before-*")) == []


def test_recreating_a_parent_table_keeps_its_children_up_and_down(database, file, tmp_path):
    upgrade_schema(database)
    fill(file)
    config = later_config(database, tmp_path / "later")
    command.upgrade(config, "heads")
    assert counts(file) == dict.fromkeys(counts(file), 1)
    command.downgrade(config, "-1")
    assert counts(file) == dict.fromkeys(counts(file), 1)
    command.upgrade(config, "heads")
    assert counts(file) == dict.fromkeys(counts(file), 1)
    with closing(sqlite3.connect(file)) as connection:
        assert connection.execute("PRAGMA foreign_key_check").fetchall() == []


def test_a_migration_that_orphans_rows_is_undone_whole(database, file, tmp_path):
    upgrade_schema(database)
    fill(file)
    before = schema_revision(database.engine)
    orphan = "op.execute(\"DELETE FROM cell WHERE name = 'c'\")"
    config = later_config(database, tmp_path / "later", orphan)
    with pytest.raises(RuntimeError, match="nothing was changed"):
        command.upgrade(config, "heads")
    assert schema_revision(database.engine) == before
    assert counts(file) == dict.fromkeys(counts(file), 1)
    with closing(sqlite3.connect(file)) as connection:
        columns = [row[1] for row in connection.execute("PRAGMA table_info(campaign)")]
    assert "remark" not in columns


def test_an_existing_file_is_copied_before_it_is_migrated(database, file, tmp_path):
    upgrade_schema(database)
    fill(file)
    config = later_config(database, tmp_path / "later")
    old = schema_revision(database.engine)
    migrate(database, config)
    assert schema_revision(database.engine) == "9999"
    copy = file.with_name(f"{file.name}.before-{old}")
    assert counts(copy) == dict.fromkeys(counts(copy), 1)


def test_foreign_keys_are_on_again_after_a_migration(database, file):
    upgrade_schema(database)
    with database.read() as session:
        assert session.connection().exec_driver_sql("PRAGMA foreign_keys").scalar() == 1
