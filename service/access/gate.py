"""Lets in who may come in: the one place where every request is asked for its caller's right.

It stands before the routes and works from the table of scopes alone: what has no line there does
not exist for anybody, whether the application has such a route or not.
"""

from http import HTTPStatus
from urllib.parse import quote

import anyio.to_thread
from fastapi import FastAPI
from starlette.datastructures import Headers
from starlette.responses import RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.access.authentication import Authentication, require_own_page, require_scope
from service.access.caller import CURRENT, CallerKind
from service.access.scopes import Scope as Right
from service.access.scopes import Unlisted, needed_for
from service.access.trail import Deed
from service.db.engine import Database
from service.errors import Problem, problem_answer

UPLOAD = "POST /api/v1/campaigns/import"
"""Bounded by a setting of its own while it is received."""
READING = frozenset({"GET", "HEAD", "OPTIONS"})


class Gate:
    """ASGI middleware; the application's state holds its `Authentication`."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Hand a request on with its caller, or refuse it."""
        if scope["type"] == "lifespan":
            return await self._app(scope, receive, send)
        if scope["type"] != "http":
            return await send({"type": "websocket.close"})
        method, path = scope["method"], scope["path"]
        try:
            line, needed = needed_for(method, path)
        except Unlisted as unlisted:
            return await _unlisted(method, path, unlisted.methods)(scope, receive, send)
        headers = Headers(scope=scope)
        most_mb = scope["app"].state.settings.json_max_mb
        if line != UPLOAD and int(headers.get("content-length", "0")) > most_mb * 1e6:
            sentence = f"{line}: the request is larger than {most_mb:g} MB; send less at once."
            answer = problem_answer(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, sentence)
            return await answer(scope, receive, send)
        authentication = _authentication(scope)
        client = scope.get("client")
        address = client[0] if client else ""
        deed = Deed("nobody", line, path, address)
        send = _with_trail(send, deed, authentication.database)
        try:
            caller = authentication.remembered(headers) if method in READING else None
            if caller is None:
                caller = await anyio.to_thread.run_sync(authentication.caller, headers, address)
            if caller.kind is not CallerKind.nobody:
                deed.who = caller.who
            require_scope(caller, needed)
            # Who logs in does so by the password, whoever the cookie names.
            if method not in READING and needed is not Right.public:
                require_own_page(caller, headers)
        except Problem as problem:
            return await _refusal(problem, scope, line)(scope, receive, send)
        scope.setdefault("state", {}).update(caller=caller, deed=deed)
        CURRENT.set(caller)
        return await self._app(scope, receive, send)


def _authentication(scope: Scope) -> Authentication:
    app: FastAPI = scope["app"]
    found: Authentication = app.state.authentication
    return found


def _unlisted(method: str, path: str, methods: tuple[str, ...]) -> Response:
    if not methods:
        return problem_answer(HTTPStatus.NOT_FOUND, f"{method} {path}: there is no such address.")
    answer = problem_answer(
        HTTPStatus.METHOD_NOT_ALLOWED, f"{method} {path}: only {', '.join(methods)} is known here."
    )
    answer.headers["Allow"] = ", ".join(methods)
    return answer


def _refusal(problem: Problem, scope: Scope, line: str) -> Response:
    """A person is led to the login, a program is told."""
    is_page = scope["method"] == "GET" and not line.startswith(("GET /api/", "GET /parts/"))
    if problem.status == HTTPStatus.UNAUTHORIZED and is_page and line != "GET /metrics":
        wanted = scope["path"]
        if scope["query_string"]:
            wanted += "?" + scope["query_string"].decode()
        return RedirectResponse(f"/login?next={quote(wanted)}", HTTPStatus.SEE_OTHER)
    return problem.answer()


def _with_trail(send: Send, deed: Deed, database: Database) -> Send:
    """Write a change that no transaction has written before its answer goes out."""

    def write(status: int) -> None:
        with database.write() as session:
            deed.write(session, status)

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start" and _is_for_the_trail(deed, message):
            await anyio.to_thread.run_sync(write, message["status"])
            deed.written = True
        await send(message)

    return sending


def _is_for_the_trail(deed: Deed, message: Message) -> bool:
    # A broken service is in the log: its database may be what is broken.
    broken = message["status"] >= HTTPStatus.INTERNAL_SERVER_ERROR
    return deed.changes and not deed.written and deed.who != "nobody" and not broken
