"""How a person wants the pages: language and light or dark, kept in two cookies of the browser."""

from contextvars import ContextVar
from dataclasses import dataclass
from enum import StrEnum

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send

from service.web.words import DEFAULT_LANGUAGE, LANGUAGES

LANGUAGE_COOKIE = "robocal_language"
THEME_COOKIE = "robocal_theme"


class Theme(StrEnum):
    """Which colours the pages have."""

    system = "system"
    light = "light"
    dark = "dark"


@dataclass(frozen=True)
class Preferences:
    """What every page asks for when it is made."""

    language: str = DEFAULT_LANGUAGE
    theme: Theme = Theme.system


_DEFAULT = Preferences()
CURRENT: ContextVar[Preferences] = ContextVar("preferences", default=_DEFAULT)
"""Of the request at hand."""


class ReadPreferences:
    """ASGI middleware: the cookies' choice, else the browser's own language."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Note the preferences for as long as the request lasts."""
        if scope["type"] == "http":
            CURRENT.set(_read(HTTPConnection(scope)))
        await self._app(scope, receive, send)


def _read(connection: HTTPConnection) -> Preferences:
    cookies = connection.cookies
    language = cookies.get(LANGUAGE_COOKIE, "")
    theme = cookies.get(THEME_COOKIE, "")
    if language not in LANGUAGES:
        language = spoken(connection.headers.get("accept-language", ""))
    return Preferences(language, Theme(theme) if theme in set(Theme) else Theme.system)


def spoken(accepted: str) -> str:
    """Return the first of a browser's languages that the pages speak.

    >>> spoken("fr-FR, zh-CN;q=0.9, en;q=0.8"), spoken("fr"), spoken("")
    ('zh', 'en', 'en')
    """
    tags = (
        part.partition(";")[0].strip().partition("-")[0].lower() for part in accepted.split(",")
    )
    return next((tag for tag in tags if tag in LANGUAGES), DEFAULT_LANGUAGE)
