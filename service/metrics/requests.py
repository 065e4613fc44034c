"""Counts requests and their times, by route: never by address, which a client makes up."""

import time

from prometheus_client import CollectorRegistry, Counter, Histogram
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_NO_ROUTE = "none"
_STREAM = "text/event-stream"
_SECONDS = (0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0)


class RequestFigures:
    """The counters of one application."""

    def __init__(self, registry: CollectorRegistry) -> None:
        labels = ("method", "route", "status")
        self._count = Counter(
            "robocal_http_requests", "Requests answered.", labels, registry=registry
        )
        self._seconds = Histogram(
            "robocal_http_request_seconds",
            "Time to the end of the answer, live pages left out.",
            ("method", "route"),
            buckets=_SECONDS,
            registry=registry,
        )

    def note(self, scope: Scope, status: int, seconds: float | None) -> None:
        """Count one answer."""
        route = getattr(scope.get("route"), "path", _NO_ROUTE)
        method = scope["method"] if route != _NO_ROUTE else "any"
        self._count.labels(method, route, str(status)).inc()
        if seconds is not None:
            self._seconds.labels(method, route).observe(seconds)


class Counted:
    """ASGI middleware that notes every answer."""

    def __init__(self, app: ASGIApp, noted: RequestFigures) -> None:
        self._app = app
        self._noted = noted

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Hand the request on."""
        if scope["type"] != "http":
            return await self._app(scope, receive, send)
        began = time.perf_counter()
        status, live = 500, False

        async def watched(message: Message) -> None:
            nonlocal status, live
            if message["type"] == "http.response.start":
                status = message["status"]
                types = [value for name, value in message["headers"] if name == b"content-type"]
                live = any(value.startswith(_STREAM.encode()) for value in types)
            await send(message)

        try:
            await self._app(scope, receive, watched)
        finally:
            self._noted.note(scope, status, None if live else time.perf_counter() - began)
        return None
