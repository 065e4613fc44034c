"""Procrastinate on the caller's own transaction: a job and what it is about stand or fall together.

Its calls to the database go over the SQLAlchemy session at hand, as its connector for Django does
with Django's connection. Some of them exist as coroutines only; none of ours ever waits.
"""

import asyncio
from collections.abc import Coroutine, Mapping, Sequence
from typing import Any, TypeVar

from procrastinate.connector import BaseConnector
from procrastinate.manager import JobManager
from psycopg.types.json import Jsonb
from sqlalchemy.orm import Session

Answer = TypeVar("Answer")
Row = dict[str, Any]


class SessionConnector(BaseConnector):
    """One session as Procrastinate's way to the database."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def get_sync_connector(self) -> BaseConnector:
        """Return itself: it serves both kinds of calls."""
        return self

    def execute_query(self, query: str, **arguments: object) -> None:
        """Run a statement."""
        self._session.connection().exec_driver_sql(query, _sendable(arguments))

    def execute_query_one(self, query: str, **arguments: object) -> Row:
        """Run a query with one row as its answer."""
        return dict(self._rows(query, arguments)[0])

    def execute_query_all(self, query: str, **arguments: object) -> list[Row]:
        """Run a query."""
        return [dict(row) for row in self._rows(query, arguments)]

    async def execute_query_async(self, query: str, **arguments: object) -> None:
        """Run a statement."""
        self.execute_query(query, **arguments)

    async def execute_query_one_async(self, query: str, **arguments: object) -> Row:
        """Run a query with one row as its answer."""
        return self.execute_query_one(query, **arguments)

    async def execute_query_all_async(self, query: str, **arguments: object) -> list[Row]:
        """Run a query."""
        return self.execute_query_all(query, **arguments)

    def _rows(self, query: str, arguments: dict[str, object]) -> Sequence[Mapping[str, Any]]:
        answer = self._session.connection().exec_driver_sql(query, _sendable(arguments))
        return [dict(row) for row in answer.mappings()]


def procrastinate(session: Session) -> JobManager:
    """Procrastinate's operations, in the session's transaction."""
    return JobManager(SessionConnector(session))


def answer_of(call: Coroutine[Any, Any, Answer]) -> Answer:
    """Run one of its coroutines to the end."""
    return asyncio.run(call)


def _sendable(arguments: dict[str, object]) -> dict[str, object]:
    return {name: _in_json(value) for name, value in arguments.items()}


def _in_json(value: object) -> object:
    if isinstance(value, dict):
        return Jsonb(value)
    if isinstance(value, tuple):
        return tuple(_in_json(part) for part in value)
    return [_in_json(part) for part in value] if isinstance(value, list) else value
