"""Pages of access: log in, use a one-time link, the own account; users, keys and the trail."""

from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import HTMLResponse

from service.access import keys, people, trail
from service.access.caller import CallerKind
from service.access.router import audit_line, key_shown, user_shown
from service.access.scopes import Scope
from service.dependencies import (
    AuthenticationDependency,
    CallerDependency,
    DatabaseDependency,
    DeedDependency,
    RowNumber,
)
from service.web.rendering import page

router = APIRouter(include_in_schema=False)

SHOWN_LINES = 50
ROLES = (Scope.operate, Scope.engineer)
KEY_SCOPES = (Scope.read, Scope.operate, Scope.engineer)


@router.get("/login")
def login_page(
    database: DatabaseDependency,
    wanted: Annotated[str, Query(alias="next", max_length=2000)] = "/",
) -> HTMLResponse:
    """Ask for name and password."""
    with database.read() as session:
        nobody_yet = people.nobody_yet(session)
    return page("login.html", next=_own_address(wanted), nobody_yet=nobody_yet)


@router.get("/welcome")
def welcome_page(
    token: Annotated[str, Query(max_length=200)],
    database: DatabaseDependency,
    authentication: AuthenticationDependency,
    deed: DeedDependency,
) -> HTMLResponse:
    """Let the holder of a one-time link choose a password."""
    with database.read() as session:
        link = people.link_of(session, token)
        person = None if link is None else link.person
    if link is None:
        authentication.failures.wrong_key(deed.address)
    return page(
        "welcome.html",
        valid=link is not None,
        token=token,
        person=person,
        shortest=people.SHORTEST_PASSWORD,
    )


@router.get("/account")
def account_page(caller: CallerDependency) -> HTMLResponse:
    """Who one is; a new password."""
    return page(
        "account.html",
        is_person=caller.kind is CallerKind.person,
        shortest=people.SHORTEST_PASSWORD,
    )


@router.get("/access")
def access_page(database: DatabaseDependency, before: RowNumber | None = None) -> HTMLResponse:
    """Users, keys, and who did what."""
    with database.read() as session:
        lines = [audit_line(row) for row in trail.page(session, before, SHOWN_LINES)]
        return page(
            "access.html",
            users=[user_shown(row) for row in people.everybody(session)],
            keys=[key_shown(row) for row in keys.all_keys(session)],
            lines=lines,
            older_than=lines[-1].id if len(lines) == SHOWN_LINES else None,
            roles=ROLES,
            key_scopes=KEY_SCOPES,
        )


def _own_address(wanted: str) -> str:
    """Return a path of this service; a link to the login must not lead on to another site."""
    outside = not wanted.startswith("/") or wanted[1:2] in {"/", "\\"} or not wanted.isprintable()
    return "/" if outside else wanted
