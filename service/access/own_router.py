"""REST: log in and out, use a one-time link, change the own password, ask who one is."""

from http import HTTPStatus

from fastapi import APIRouter, Request, Response
from fastapi.responses import JSONResponse

from service.access import logins, people
from service.access.caller import Caller, CallerKind
from service.access.models import LogIn, Me, NewPassword, Welcome
from service.access.scopes import Scope
from service.access.secrets import form_token
from service.dependencies import (
    AuthenticationDependency,
    CallerDependency,
    DatabaseDependency,
    DeedDependency,
    SettingsDependency,
)
from service.errors import Forbidden, Unauthorised

router = APIRouter(tags=["access"])


@router.get("/me")
def me(caller: CallerDependency) -> Me:
    """Who the service takes the caller for."""
    return _shown(caller)


@router.post("/login", response_model=Me)
def log_in(
    given: LogIn,
    request: Request,
    database: DatabaseDependency,
    settings: SettingsDependency,
    authentication: AuthenticationDependency,
    deed: DeedDependency,
) -> Response:
    """Log a person in; the answer sets the cookie."""
    authentication.failures.attempt(deed.address, given.name)
    if not logins.password_fits(database, given.name, given.password.get_secret_value()):
        deed.who = f"nobody as {given.name}"
        raise Unauthorised("Name or password is wrong.")
    authentication.failures.succeeded(deed.address, given.name)
    with database.write() as session:
        person = people.find(session, given.name)
        caller = logins.begin(session, person, settings.login_hours)
        deed.who = caller.who
        deed.write(session, HTTPStatus.OK)
    deed.written = True
    return _logged_in(request, caller, settings.login_hours)


@router.post("/welcome", response_model=Me)
def use_link(
    given: Welcome,
    request: Request,
    database: DatabaseDependency,
    settings: SettingsDependency,
    authentication: AuthenticationDependency,
    deed: DeedDependency,
) -> Response:
    """Choose a password by a one-time link, and be logged in."""
    token, password = given.token.get_secret_value(), given.password.get_secret_value()
    with database.write() as session:
        person = people.use_link(session, token, given.name, password)
        if person is not None:
            caller = logins.begin(session, person, settings.login_hours)
            deed.who = caller.who
            deed.write(session, HTTPStatus.OK)
    if person is None:
        authentication.failures.wrong_key(deed.address)
        deed.who = "nobody with a link"
        raise Unauthorised("This link was used or is too old; ask an engineer for a new one.")
    deed.written = True
    return _logged_in(request, caller, settings.login_hours)


@router.post("/logout", response_model=Me)
def log_out(caller: CallerDependency, database: DatabaseDependency) -> Response:
    """End this login."""
    with database.write() as session:
        logins.end(session, caller.login_token)
    answer = JSONResponse(_shown(Caller(CallerKind.nobody, "", Scope.public)).model_dump())
    logins.take_cookie(answer)
    return answer


@router.post("/password", response_model=Me)
def change_password(
    given: NewPassword,
    request: Request,
    caller: CallerDependency,
    database: DatabaseDependency,
    settings: SettingsDependency,
    authentication: AuthenticationDependency,
    deed: DeedDependency,
) -> Response:
    """Change the own password; other browsers are logged out."""
    if caller.kind is not CallerKind.person:
        raise Forbidden("Only a logged-in person has a password to change.")
    authentication.failures.attempt(deed.address, caller.name)
    if not logins.password_fits(database, caller.name, given.old.get_secret_value()):
        raise Forbidden("The old password is wrong.")
    authentication.failures.succeeded(deed.address, caller.name)
    with database.write() as session:
        person = people.find(session, caller.name)
        people.set_password(session, person, given.new.get_secret_value())
        caller = logins.begin(session, person, settings.login_hours)
        deed.write(session, HTTPStatus.OK)
    deed.written = True
    return _logged_in(request, caller, settings.login_hours)


def _logged_in(request: Request, caller: Caller, hours: float) -> Response:
    answer = JSONResponse(_shown(caller).model_dump())
    logins.give_cookie(request, answer, caller.login_token, hours)
    return answer


def _shown(caller: Caller) -> Me:
    token = form_token(caller.login_token) if caller.login_token else ""
    return Me(kind=caller.kind, name=caller.name, scope=caller.scope, csrf_token=token)
