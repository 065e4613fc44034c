"""Who sends a request."""

from contextvars import ContextVar
from dataclasses import dataclass
from enum import StrEnum

from service.access.scopes import Scope


class CallerKind(StrEnum):
    """How a caller is known."""

    nobody = "nobody"
    person = "person"
    key = "key"
    anyone = "anyone"
    """Whoever reaches a service that was started with access open."""


@dataclass(frozen=True)
class Caller:
    """Somebody, with what he may do."""

    kind: CallerKind
    name: str
    scope: Scope
    login_token: str = ""
    """Of a person: what the browser's cookie holds. Never shown."""

    @property
    def who(self) -> str:
        """Kind and name, as the audit trail and the history of parameters keep them."""
        return f"{self.kind} {self.name}".strip()


NOBODY = Caller(CallerKind.nobody, "", Scope.public)
ANYONE = Caller(CallerKind.anyone, "", Scope.engineer)

CURRENT: ContextVar[Caller] = ContextVar("caller", default=NOBODY)
"""Whom the request at hand is answered for; what every page shows of it."""
