"""Keeps other web sites from reaching the service through an operator's browser.

The service listens on the loopback address, and browsers let any page send requests there. Two
ways are closed: a request that changes something and comes from another site's page (cross-site
request forgery), and a foreign name that resolves to this machine (DNS rebinding), which shows in
the Host header alone.
"""

from http import HTTPStatus
from ipaddress import ip_address

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from service.errors import problem_answer

_READING = frozenset({"GET", "HEAD", "OPTIONS"})


class Guard:
    """ASGI middleware.

    Parameters
    ----------
    app
        What it protects.
    hosts
        Names besides the loopback ones under which the service may be addressed.
    """

    def __init__(self, app: ASGIApp, hosts: tuple[str, ...]) -> None:
        self._app = app
        self._hosts = frozenset(host.lower() for host in hosts)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Hand a request on, or refuse it."""
        if scope["type"] == "http":
            headers = Headers(scope=scope)
            host = headers.get("host", "")
            if not self._is_ours(host):
                sentence = (
                    f"This service is not '{host}'; use its own address, or name the host in "
                    "ROBOCAL_HOSTS."
                )
                answer = problem_answer(HTTPStatus.MISDIRECTED_REQUEST, sentence)
                return await answer(scope, receive, send)
            if scope["method"] not in _READING and _is_foreign(headers, host):
                sentence = (
                    "The request comes from a page of another site, which may read here but "
                    "change nothing."
                )
                return await problem_answer(HTTPStatus.FORBIDDEN, sentence)(scope, receive, send)
        return await self._app(scope, receive, send)

    def _is_ours(self, host: str) -> bool:
        name = _without_port(host).lower()
        return name == "localhost" or name in self._hosts or _is_loopback(name)


def _is_foreign(headers: Headers, host: str) -> bool:
    """Whether a page of another origin sent the request; programs send neither header."""
    if headers.get("sec-fetch-site") == "cross-site":
        return True
    origin = headers.get("origin")
    # Without the scheme: behind a proxy that speaks TLS the service does not know its own.
    return origin is not None and origin.partition("://")[2].lower() != host.lower()


def _without_port(host: str) -> str:
    if host.startswith("["):
        return host[1:].partition("]")[0]
    return host.partition(":")[0]


def _is_loopback(name: str) -> bool:
    try:
        return ip_address(name).is_loopback
    except ValueError:
        return False
