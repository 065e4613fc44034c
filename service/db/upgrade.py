"""Bring a database to the schema of this program: Alembic, with a copy of the file first."""

import sqlite3
from contextlib import closing
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Engine

from service.db.engine import QUEUE_SCHEMA, Database, sqlite_file

MIGRATIONS = Path(__file__).resolve().parents[2] / "migrations"


def upgrade_schema(database: Database) -> None:
    """Run the migrations that the database has not seen. Safe to call from several processes."""
    migrate(database, alembic_config(database.engine))


def migrate(database: Database, config: Config) -> None:
    """Upgrade to the newest migration that `config` finds, with a copy of the file first."""
    newest = ScriptDirectory.from_config(config).get_current_head()
    present = schema_revision(database.engine)
    if present == newest:
        return
    if present is not None:
        back_up(database.engine, present)
    command.upgrade(config, "head")


def is_up_to_date(database: Database) -> bool:
    """Whether the database stands at this program's schema."""
    newest = ScriptDirectory.from_config(alembic_config(database.engine)).get_current_head()
    return schema_revision(database.engine) == newest


def empty_schema(database: Database) -> None:
    """Remove everything that is stored, and make the tables anew."""
    config = alembic_config(database.engine)
    command.downgrade(config, "base")
    command.upgrade(config, "head")


def schema_revision(engine: Engine) -> str | None:
    """Return the migration that the database stands at; None for an empty one."""
    with engine.connect() as connection:
        return MigrationContext.configure(connection).get_current_revision()


def is_ours(name: str | None, kind: str, parents: object) -> bool:
    """Whether a table is made by our migrations' own words; the queue's are Procrastinate's."""
    return kind != "table" or name is None or not name.startswith(QUEUE_SCHEMA)


def alembic_config(engine: Engine) -> Config:
    """Alembic's configuration for this database, without an ini file."""
    config = Config(attributes={"engine": engine})
    config.set_main_option("script_location", str(MIGRATIONS))
    config.set_main_option("path_separator", "os")
    return config


def back_up(engine: Engine, revision: str) -> None:
    """Copy an SQLite file beside itself before it is changed; other databases have own means."""
    path = sqlite_file(engine.url.render_as_string(hide_password=False))
    if path is None:
        return
    copy = path.with_name(f"{path.name}.before-{revision}")
    with closing(sqlite3.connect(path)) as source, closing(sqlite3.connect(copy)) as target:
        source.backup(target)
