"""What routes ask for: the database, the queue, the settings, one POST with its key."""

import hashlib
from datetime import datetime
from typing import Annotated

from fastapi import Depends, Header, Query, Request
from pydantic import AfterValidator, Field

from service.access.authentication import Authentication
from service.access.caller import Caller
from service.access.trail import Deed
from service.db.engine import Database
from service.idempotency import Once, request_digest
from service.jobs.queue import JobQueue
from service.settings import Settings


def _of_our_time(moment: datetime) -> datetime:
    # Near the ends of the calendar a time zone leads out of it.
    if not 1970 <= moment.year < 9000:
        raise ValueError("must lie between the years 1970 and 9000")
    return moment


RowNumber = Annotated[int, Field(ge=0, lt=2**31)]
"""The number of a campaign, version or revision: what the databases' integers hold."""
Moment = Annotated[datetime, AfterValidator(_of_our_time)]
PageSize = Annotated[int, Query(ge=1, le=200, description="rows of a page")]
IdempotencyKey = Annotated[str | None, Header(min_length=1, max_length=200)]


# Coroutines, although they wait for nothing: a plain function would cost a change of threads.
async def _database(request: Request) -> Database:
    database: Database = request.app.state.database
    return database


async def _queue(request: Request) -> JobQueue:
    queue: JobQueue = request.app.state.queue
    return queue


async def _settings(request: Request) -> Settings:
    settings: Settings = request.app.state.settings
    return settings


def current_person(caller: "CallerDependency") -> str:
    """Who sent the request, as the history names them."""
    return caller.who


def _caller(request: Request) -> Caller:
    caller: Caller = request.state.caller
    return caller


def _deed(request: Request) -> Deed:
    deed: Deed = request.state.deed
    return deed


def _authentication(request: Request) -> Authentication:
    authentication: Authentication = request.app.state.authentication
    return authentication


DatabaseDependency = Annotated[Database, Depends(_database)]
QueueDependency = Annotated[JobQueue, Depends(_queue)]
SettingsDependency = Annotated[Settings, Depends(_settings)]
CallerDependency = Annotated[Caller, Depends(_caller)]
"""Who asks: `caller.who` is what histories keep."""
DeedDependency = Annotated[Deed, Depends(_deed)]
AuthenticationDependency = Annotated[Authentication, Depends(_authentication)]


async def _once(
    request: Request, database: DatabaseDependency, idempotency_key: IdempotencyKey = None
) -> Once:
    body_sha256 = hashlib.sha256(await request.body()).hexdigest()
    return once_of(request, database, idempotency_key, body_sha256)


def once_of(request: Request, database: Database, key: str | None, body_sha256: str) -> Once:
    """One POST; the body's hash is given because an upload is not kept in memory."""
    target = f"{request.state.caller.who} {request.url.path}?{request.url.query}"
    digest = request_digest(request.method, target, body_sha256)
    return Once(database, key, digest, request.state.deed)


PersonDependency = Annotated[str, Depends(current_person)]
OnceDependency = Annotated[Once, Depends(_once)]
