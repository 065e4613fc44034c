"""Copy all rows of one database into another, of the same kind or not, and compare what arrived."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Table, func, insert, select, text
from sqlalchemy.orm import Session

from robocal.errors import BadInput
from service.db.models import Base, ProbeRow, WhereaboutsRow, WorkerRow

_OF_THE_MOMENT = {row.__tablename__ for row in (WorkerRow, ProbeRow, WhereaboutsRow)}
"""Tables that speak of running processes, not of what was measured."""
_AT_ONCE = 500


@dataclass(frozen=True)
class CopiedTable:
    """What arrived in one table; the hash is over all its rows, in whatever order they came."""

    name: str
    rows: int
    sha256: str


def tables() -> list[Table]:
    """All tables to be copied, parents before their children."""
    return [table for table in Base.metadata.sorted_tables if table.name not in _OF_THE_MOMENT]


def is_empty(session: Session) -> bool:
    """Whether nothing is there that a copy could harm."""
    return not any(
        session.scalar(select(func.count()).select_from(table)) or 0 for table in tables()
    )


def copy_rows(source: Session, target: Session) -> list[CopiedTable]:
    """Copy everything in the caller's two transactions.

    Raises
    ------
    BadInput
        If a table arrived otherwise than it was sent; the caller's transaction undoes it all.
    """
    copied = []
    for table in tables():
        for rows in _parts(source, table):
            target.execute(insert(table), rows)
        sent, arrived = summary(source, table), summary(target, table)
        if sent != arrived:
            raise BadInput(
                f"table '{table.name}'",
                f"{sent.rows} rows were sent and {arrived.rows} arrived, with another content; "
                "nothing was stored",
            )
        copied.append(arrived)
        _go_on_counting(target, table)
    return copied


def summary(session: Session, table: Table) -> CopiedTable:
    """Count and hash the rows of a table."""
    digests = sorted(_digest(row) for rows in _parts(session, table) for row in rows)
    return CopiedTable(table.name, len(digests), hashlib.sha256(b"".join(digests)).hexdigest())


def _parts(session: Session, table: Table) -> Iterator[Sequence[dict[str, Any]]]:
    found = session.execute(select(table).execution_options(yield_per=_AT_ONCE))
    for part in found.mappings().partitions(_AT_ONCE):
        yield [dict(row) for row in part]


def _digest(row: dict[str, Any]) -> bytes:
    written = json.dumps(row, sort_keys=True, default=_as_text)
    return hashlib.sha256(written.encode()).digest()


def _as_text(value: bytes) -> str:
    return hashlib.sha256(value).hexdigest()


def _go_on_counting(session: Session, table: Table) -> None:
    """Let PostgreSQL number new rows after the copied ones, as SQLite does by itself."""
    keys = list(table.primary_key)
    if session.get_bind().dialect.name != "postgresql" or [key.name for key in keys] != ["id"]:
        return
    session.execute(
        text(
            f"SELECT setval(pg_get_serial_sequence('{table.name}', 'id'), max(id)) "
            f"FROM {table.name} HAVING max(id) IS NOT NULL"
        )
    )
