"""A person who meets an error in the browser reads it on a page; a program gets problem+json."""

import json
from http import HTTPStatus

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.web.rendering import page

_FOR_PROGRAMS = ("/api/", "/parts/", "/assets/")


class ProblemPages:
    """ASGI middleware; stands before all that may refuse a request."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Hand a request on, and put its problem on a page where a person waits for one."""
        wanted = scope["type"] == "http" and _wants_page(scope)
        await self._app(scope, receive, _on_a_page(send) if wanted else send)


def _wants_page(scope: Scope) -> bool:
    is_page = scope["method"] == "GET" and not scope["path"].startswith(_FOR_PROGRAMS)
    return is_page and "text/html" in Headers(scope=scope).get("accept", "")


def _on_a_page(send: Send) -> Send:
    held: list[Message] = []

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start" and _is_problem(message):
            held.append(message)
        elif not held:
            await send(message)
        elif message["type"] == "http.response.body":
            held.append(message)
            if not message.get("more_body", False):
                for part in _page_of(*held):
                    await send(part)

    return sending


def _is_problem(message: Message) -> bool:
    return Headers(scope=message).get("content-type", "").startswith("application/problem+json")


def _page_of(start: Message, *bodies: Message) -> tuple[Message, Message]:
    problem = json.loads(b"".join(body.get("body", b"") for body in bodies))
    shown = page("problem.html", HTTPStatus(problem["status"]), sentence=problem["detail"])
    MutableHeaders(scope=start).update(shown.headers)
    return start, {"type": "http.response.body", "body": shown.body}
