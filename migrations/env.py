"""Alembic's entry: one transaction for all migrations, foreign keys off around it.

With foreign keys on, SQLite's batch mode (new table, copy, drop, rename) deletes the children of
the table that it recreates; the switch is ignored inside a transaction, so it stands outside, and
`foreign_key_check` stands in for it before the commit.
"""

from alembic import context
from sqlalchemy import Connection, Engine

from service.db.engine import open_database
from service.db.models import Base
from service.db.upgrade import is_ours
from service.settings import Settings


def _engine() -> Engine:
    given = context.config.attributes.get("engine")
    if given is None:
        return open_database(Settings().database_url).engine
    assert isinstance(given, Engine)
    return given


def _migrate(connection: Connection) -> None:
    context.configure(
        connection=connection,
        target_metadata=Base.metadata,
        render_as_batch=True,
        transactional_ddl=True,
        compare_type=True,
        include_name=is_ours,
    )
    with context.begin_transaction():
        context.run_migrations()
        if connection.dialect.name == "sqlite":
            broken = connection.exec_driver_sql("PRAGMA foreign_key_check").all()
            if broken:
                raise RuntimeError(
                    f"migration leaves rows without their parent (table, rowid, parent): "
                    f"{broken[:5]}; nothing was changed"
                )


def run() -> None:
    """Migrate the database at hand."""
    writer = _engine().execution_options(robocal_writes=True)
    with writer.connect() as connection:
        sqlite = connection.dialect.name == "sqlite"
        if sqlite:
            _set_foreign_keys(connection, "OFF")
        try:
            _migrate(connection)
        finally:
            if sqlite:
                _set_foreign_keys(connection, "ON")


def _set_foreign_keys(connection: Connection, value: str) -> None:
    driver = connection.connection.driver_connection
    assert driver is not None
    driver.execute(f"PRAGMA foreign_keys = {value}")


run()
