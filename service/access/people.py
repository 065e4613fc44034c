"""People who may log in, and the one-time links by which they choose their passwords.

Nobody is given a password: an engineer makes the person, the service makes a link, and whoever
opens it chooses. The very first engineer gets such a link when the service starts.
"""

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session

from service.access.moments import in_hours
from service.access.scopes import Scope
from service.access.secrets import digest, new_token, password_digest
from service.clock import utc_now
from service.db.access_tables import LinkRow, LoginRow, PersonRow
from service.errors import Conflict, NotFound, Unusable

LINK_HOURS = 24.0
SHORTEST_PASSWORD = 10


def create(session: Session, name: str, role: Scope, by: str) -> PersonRow:
    """Make a person, who cannot log in before choosing a password; raises `Conflict`."""
    if session.get(PersonRow, name) is not None:
        raise Conflict(f"There is a user named '{name}' already.")
    row = PersonRow(name=name, role=role, disabled=False, created=utc_now(), created_by=by)
    session.add(row)
    session.flush()
    return row


def find(session: Session, name: str) -> PersonRow:
    """Return one person; raises `NotFound`."""
    row = session.get(PersonRow, name)
    if row is None:
        raise NotFound(f"There is no user '{name}'.")
    return row


def everybody(session: Session) -> list[PersonRow]:
    """All people by name, disabled ones too."""
    return list(session.scalars(select(PersonRow).order_by(PersonRow.name)))


def nobody_yet(session: Session) -> bool:
    """Whether no one has ever been able to log in."""
    with_password = select(func.count()).where(PersonRow.password_hash.is_not(None))
    return session.scalar(with_password) == 0


def disable(session: Session, name: str) -> PersonRow:
    """End a person's access at once; raises `Conflict` for the last engineer."""
    row = find(session, name)
    others = select(func.count()).where(
        PersonRow.role == Scope.engineer,
        PersonRow.name != name,
        PersonRow.disabled.is_(False),
        PersonRow.password_hash.is_not(None),
    )
    could_log_in = row.password_hash is not None and not row.disabled
    if row.role == Scope.engineer and could_log_in and session.scalar(others) == 0:
        raise Conflict(f"'{name}' is the only engineer who can log in; make another one first.")
    row.disabled = True
    _forget(session, name)
    return row


def new_link(session: Session, name: str) -> tuple[str, str]:
    """Return a fresh token for a person and when it expires; earlier ones end. Enables again."""
    row = find(session, name)
    row.disabled = False
    session.execute(delete(LinkRow).where(LinkRow.person == name, LinkRow.used.is_(None)))
    return _link(session, name)


def needs_first_link(session: Session) -> bool:
    """Whether `first_link` has a link to make, or one to end that may no longer be used."""
    left_over = select(func.count()).where(LinkRow.person.is_(None), LinkRow.used.is_(None))
    return nobody_yet(session) or session.scalar(left_over) != 0


def first_link(session: Session) -> str | None:
    """Return a token for the first engineer, or None when somebody can log in already."""
    session.execute(delete(LinkRow).where(LinkRow.person.is_(None), LinkRow.used.is_(None)))
    if not nobody_yet(session):
        return None
    return _link(session, None)[0]


def link_of(session: Session, token: str) -> LinkRow | None:
    """Return a link that can still be used."""
    row = session.get(LinkRow, digest(token))
    if row is None or row.used is not None or row.expires <= utc_now():
        return None
    return row


def use_link(session: Session, token: str, name: str | None, password: str) -> PersonRow | None:
    """Set the password that a link allows to set, once; None if the link is not valid.

    Raises
    ------
    Unusable, Conflict
        If name or password cannot be; the link stays valid.
    """
    link = link_of(session, token)
    if link is None:
        return None
    if link.person is None:
        if name is None:
            raise Unusable("body name: choose a name for the first engineer.")
        row = create(session, name, Scope.engineer, "first start")
    else:
        row = find(session, link.person)
    set_password(session, row, password)
    taken = session.execute(
        update(LinkRow)
        .where(LinkRow.token_sha256 == link.token_sha256, LinkRow.used.is_(None))
        .values(used=utc_now())
        .returning(LinkRow.token_sha256)
    )
    return row if taken.first() is not None else None


def set_password(session: Session, person: PersonRow, password: str) -> None:
    """Store a new password and end the person's logins; raises `Unusable` for a weak one."""
    if len(password) < SHORTEST_PASSWORD:
        raise Unusable(f"body password: take at least {SHORTEST_PASSWORD} characters.")
    if person.name.lower() in password.lower() or len(set(password)) < SHORTEST_PASSWORD // 2:
        raise Unusable("body password: too easy to guess; do not use your name or one character.")
    person.password_hash = password_digest(password)
    _forget(session, person.name)


def _link(session: Session, person: str | None) -> tuple[str, str]:
    token, expires = new_token(), in_hours(LINK_HOURS)
    session.add(
        LinkRow(token_sha256=digest(token), person=person, created=utc_now(), expires=expires)
    )
    session.flush()
    return token, expires


def _forget(session: Session, name: str) -> None:
    session.execute(delete(LoginRow).where(LoginRow.person == name))
