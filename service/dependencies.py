"""What routes ask for: the database, the queue, the settings, one POST with its key."""

import hashlib
from typing import Annotated

from fastapi import Depends, Header, Request
from pydantic import Field

from service.db.engine import Database
from service.idempotency import Once, request_digest
from service.jobs.queue import JobQueue
from service.settings import Settings

RowNumber = Annotated[int, Field(ge=0, lt=2**63)]
"""The number of a campaign, version or revision: what the database's integers hold."""
IdempotencyKey = Annotated[str | None, Header(min_length=1, max_length=200)]


def _database(request: Request) -> Database:
    database: Database = request.app.state.database
    return database


def _queue(request: Request) -> JobQueue:
    queue: JobQueue = request.app.state.queue
    return queue


def _settings(request: Request) -> Settings:
    settings: Settings = request.app.state.settings
    return settings


DatabaseDependency = Annotated[Database, Depends(_database)]
QueueDependency = Annotated[JobQueue, Depends(_queue)]
SettingsDependency = Annotated[Settings, Depends(_settings)]


async def _once(
    request: Request, database: DatabaseDependency, idempotency_key: IdempotencyKey = None
) -> Once:
    body_sha256 = hashlib.sha256(await request.body()).hexdigest()
    return once_of(request, database, idempotency_key, body_sha256)


def once_of(request: Request, database: Database, key: str | None, body_sha256: str) -> Once:
    """One POST; the body's hash is given because an upload is not kept in memory."""
    target = f"{request.url.path}?{request.url.query}"
    return Once(database, key, request_digest(request.method, target, body_sha256))


OnceDependency = Annotated[Once, Depends(_once)]
