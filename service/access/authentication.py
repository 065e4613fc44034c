"""From the headers of a request to its caller."""

from collections.abc import Callable
from dataclasses import dataclass, field

from starlette.datastructures import Headers
from starlette.requests import cookie_parser

from service.access import keys, logins
from service.access.caller import ANYONE, NOBODY, Caller, CallerKind
from service.access.failures import Failures
from service.access.known_keys import KnownKeys
from service.access.scopes import Scope
from service.access.secrets import form_token, same
from service.db.engine import Database
from service.errors import Forbidden, Unauthorised

FORM_TOKEN_HEADER = "X-CSRF-Token"


@dataclass(frozen=True)
class Authentication:
    """Finds the caller of a request.

    Parameters
    ----------
    is_open
        Whether whoever reaches the service may do everything.
    key_used
        Told the number of every key that is used.
    """

    database: Database
    failures: Failures
    is_open: bool
    key_used: Callable[[int], None]
    known: KnownKeys = field(default_factory=KnownKeys)

    def remembered(self, headers: Headers) -> Caller | None:
        """Return whose key came, if it was valid a moment ago; for requests that only read."""
        kind, _, key = headers.get("authorization", "").partition(" ")
        found = self.known.find(key.strip()) if kind.lower() == "bearer" else None
        if self.is_open or found is None:
            return None
        number, caller = found
        self.key_used(number)
        return caller

    def caller(self, headers: Headers, address: str) -> Caller:
        """Return who it is, `NOBODY` if no credentials came.

        Raises
        ------
        Unauthorised, TooMany
            If a key came that is not valid. A cookie that is not valid is nobody's: logins end.
        """
        if self.is_open:
            return ANYONE
        authorization = headers.get("authorization")
        if authorization is not None:
            return self._key_holder(authorization, address)
        token = cookie_parser(headers.get("cookie", "")).get(logins.COOKIE)
        if token is None:
            return NOBODY
        with self.database.read() as session:
            return logins.caller_of(session, token) or NOBODY

    def _key_holder(self, authorization: str, address: str) -> Caller:
        kind, _, key = authorization.partition(" ")
        if kind.lower() != "bearer":
            raise Unauthorised("Authorization: send 'Bearer' and a key.")
        with self.database.read() as session:
            row = keys.verified(session, key.strip())
            known = None if row is None else (row.id, row.name, Scope(row.scope))
        if known is None:
            self.failures.wrong_key(address)
            raise Unauthorised("Authorization: the key is not valid; ask an engineer for one.")
        number, name, scope = known
        self.key_used(number)
        caller = Caller(CallerKind.key, name, scope)
        self.known.keep(key.strip(), number, caller)
        return caller


def require_scope(caller: Caller, needed: Scope) -> None:
    """Raise `Unauthorised` or `Forbidden` unless the caller may do what needs this scope."""
    if caller.scope.covers(needed):
        return
    if caller.kind is CallerKind.nobody:
        raise Unauthorised(
            "Nobody is logged in: log in at /login, or send a key as 'Authorization: Bearer KEY'."
        )
    raise Forbidden(
        f"This needs the right '{needed}'; {caller.who} has '{caller.scope}'. "
        "An engineer can do it or give the right."
    )


def require_own_page(caller: Caller, headers: Headers) -> None:
    """Raise `Forbidden` unless a change by a logged-in person comes from a page of ours.

    The browser sends the cookie with requests of any site; the token stands in our pages alone.
    """
    if caller.kind is not CallerKind.person:
        return
    given = headers.get(FORM_TOKEN_HEADER)
    if given is None or not same(given, form_token(caller.login_token)):
        raise Forbidden(
            f"The header {FORM_TOKEN_HEADER} is missing or not that of this login; "
            "load the page again."
        )
