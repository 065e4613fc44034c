"""Logins of people: the browser holds a random token in a cookie, the database its hash."""

from fastapi import Request, Response
from sqlalchemy import delete
from sqlalchemy.orm import Session

from service.access.caller import Caller, CallerKind
from service.access.moments import in_hours
from service.access.scopes import Scope
from service.access.secrets import digest, is_password, new_token
from service.clock import utc_now
from service.db.access_tables import LoginRow, PersonRow
from service.db.engine import Database

COOKIE = "robocal_login"


def password_fits(database: Database, name: str, password: str) -> bool:
    """Whether a person may log in with it; takes as long for a name that does not exist."""
    with database.read() as session:
        person = session.get(PersonRow, name)
        stored = None if person is None or person.disabled else person.password_hash
    # Outside the transaction: hashing takes a fifth of a second.
    return is_password(password, stored)


def begin(session: Session, person: PersonRow, hours: float) -> Caller:
    """Log a person in from one more browser."""
    session.execute(delete(LoginRow).where(LoginRow.expires <= utc_now()))
    token = new_token()
    session.add(
        LoginRow(
            token_sha256=digest(token),
            person=person.name,
            created=utc_now(),
            expires=in_hours(hours),
        )
    )
    return Caller(CallerKind.person, person.name, Scope(person.role), token)


def end(session: Session, token: str) -> None:
    """Log this browser out."""
    session.execute(delete(LoginRow).where(LoginRow.token_sha256 == digest(token)))


def caller_of(session: Session, token: str) -> Caller | None:
    """Return who holds a token, while the login lasts."""
    login = session.get(LoginRow, digest(token))
    if login is None or login.expires <= utc_now():
        return None
    person = session.get(PersonRow, login.person)
    if person is None or person.disabled:
        return None
    return Caller(CallerKind.person, person.name, Scope(person.role), token)


def give_cookie(request: Request, response: Response, token: str, hours: float) -> None:
    """Let the browser keep the token where no script can read it."""
    response.set_cookie(
        COOKIE,
        token,
        max_age=round(hours * 3600),
        httponly=True,
        # Lax, not strict: a link from the MES to a campaign must find the person logged in.
        samesite="lax",
        secure=request.url.scheme == "https",
    )


def take_cookie(response: Response) -> None:
    """Let the browser forget the token."""
    response.delete_cookie(COOKIE, httponly=True, samesite="lax")
