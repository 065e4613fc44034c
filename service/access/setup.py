"""Puts access before an application's routes."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fastapi import FastAPI
from fastapi.routing import iter_route_contexts

from service.access import keys, people
from service.access.authentication import FORM_TOKEN_HEADER, Authentication
from service.access.failures import Failures
from service.access.gate import Gate
from service.access.headers import SafeHeaders
from service.access.last_used import LastUsed
from service.access.logins import COOKIE
from service.access.scopes import WHO_MAY, Scope, needed_for
from service.db.engine import Database, open_database
from service.db.waiting import when_free
from service.guard import Guard
from service.settings import OPEN, Settings

_METHODS = frozenset({"GET", "POST", "PUT", "PATCH", "DELETE"})


def install(app: FastAPI, settings: Settings) -> None:
    """Add the middlewares (the last one stands outermost) and describe them in the API."""
    app.add_middleware(Gate)
    app.add_middleware(Guard, hosts=settings.hosts)
    app.add_middleware(SafeHeaders)
    plain = app.openapi

    def described() -> dict[str, Any]:
        if app.openapi_schema is None:
            _describe(plain())
        return plain()

    app.__dict__["openapi"] = described


def require_listed(app: FastAPI) -> None:
    """Raise `LookupError` for a route that says nowhere who may call it: nobody could."""
    for route in iter_route_contexts(app.routes):
        for method in sorted(route.methods or ()):
            if method in _METHODS and f"{method} {route.path}" not in WHO_MAY:
                raise LookupError(
                    f"nobody may call {method} {route.path}: give it a line in "
                    "service/access/scopes.py"
                )


@contextmanager
def admitted(app: FastAPI, settings: Settings, database: Database) -> Iterator[None]:
    """Let callers in while the application runs."""
    _bring_bootstrap(settings, database)
    with LastUsed(database) as last_used:
        app.state.authentication = Authentication(
            database, Failures(), settings.access == OPEN, last_used.note
        )
        yield


def prepare_access(settings: Settings) -> str | None:
    """Bring the settings' key, and make the first engineer's link where one is missing: its path.

    Waits while another program keeps the database locked; what stands already is only read.
    """
    database = open_database(settings.database_url, settings.busy_s)
    try:
        when_free(lambda: _bring_bootstrap(settings, database))
        return when_free(lambda: _first_link(settings, database))
    finally:
        database.close()


def _bring_bootstrap(settings: Settings, database: Database) -> None:
    key = None if settings.bootstrap_key is None else settings.bootstrap_key.get_secret_value()
    with database.read() as session:
        if keys.bootstrap_stands(session, key):
            return
    with database.write() as session:
        keys.set_bootstrap(session, key)


def _first_link(settings: Settings, database: Database) -> str | None:
    if settings.access == OPEN:
        return None
    with database.read() as session:
        if not people.needs_first_link(session):
            return None
    with database.write() as session:
        token = people.first_link(session)
    return None if token is None else f"/welcome?token={token}"


def _describe(document: dict[str, Any]) -> None:
    """Say in the API's description how to be let in, and what each call needs."""
    document["components"]["securitySchemes"] = {
        "key": {"type": "http", "scheme": "bearer", "description": "A key made by an engineer."},
        "login": {
            "type": "apiKey",
            "in": "cookie",
            "name": COOKIE,
            "description": f"A person logged in; changes need the header {FORM_TOKEN_HEADER} too.",
        },
    }
    for path, operations in document["paths"].items():
        for method, operation in operations.items():
            if method.upper() in _METHODS:
                _, needed = needed_for(method.upper(), path)
                is_public = needed is Scope.public
                operation["security"] = [] if is_public else [{"key": []}, {"login": []}]
                operation["x-scope"] = str(needed)
