"""Keys of programs: made once, shown once, stored as their SHA-256."""

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service.access.scopes import Scope
from service.access.secrets import PREFIX_LENGTH, digest, new_key, same
from service.clock import utc_now
from service.db.access_tables import ApiKeyRow
from service.errors import Conflict, NotFound

BOOTSTRAP = "bootstrap"
"""Name of the key that the setting `bootstrap_key` brings."""


def create(session: Session, name: str, scope: Scope, by: str) -> tuple[ApiKeyRow, str]:
    """Make a key; returns its row and the key itself, which is stored nowhere.

    Raises
    ------
    Conflict
        If a valid key has that name.
    """
    if name == BOOTSTRAP or _valid(session, name) is not None:
        raise Conflict(f"There is a valid key named '{name}'; choose another name.")
    key = new_key()
    row = _row(name, scope, key, by)
    session.add(row)
    session.flush()
    return row, key


def verified(session: Session, key: str) -> ApiKeyRow | None:
    """Return the row of a valid key."""
    wanted = digest(key)
    row = session.scalar(
        select(ApiKeyRow).where(ApiKeyRow.secret_sha256 == wanted, ApiKeyRow.revoked.is_(None))
    )
    return row if row is not None and same(row.secret_sha256, wanted) else None


def all_keys(session: Session) -> list[ApiKeyRow]:
    """All keys, newest first, revoked ones too."""
    return list(session.scalars(select(ApiKeyRow).order_by(ApiKeyRow.id.desc())))


def revoke(session: Session, number: int) -> ApiKeyRow:
    """Make a key invalid for good; raises `NotFound`."""
    row = session.get(ApiKeyRow, number)
    if row is None:
        raise NotFound(f"There is no key {number}.")
    if row.revoked is None:
        row.revoked = utc_now()
    return row


def by_name(session: Session, name: str) -> ApiKeyRow:
    """Return the valid key of a name; raises `NotFound`."""
    row = _valid(session, name)
    if row is None:
        raise NotFound(f"There is no valid key named '{name}'.")
    return row


def used(session: Session, moments: dict[int, str]) -> None:
    """Keep when keys were last used."""
    for number, moment in moments.items():
        session.execute(update(ApiKeyRow).where(ApiKeyRow.id == number).values(last_used=moment))


def bootstrap_stands(session: Session, key: str | None) -> bool:
    """Whether the key that the settings name, or none, is the valid one already."""
    present = _valid(session, BOOTSTRAP)
    if present is None or key is None:
        return present is None and key is None
    return same(present.secret_sha256, digest(key))


def set_bootstrap(session: Session, key: str | None) -> None:
    """Let the key of the settings be valid, and end the one that they no longer name."""
    if bootstrap_stands(session, key):
        return
    present = _valid(session, BOOTSTRAP)
    if present is not None:
        present.revoked = utc_now()
        # One valid key a name: the old one must be gone before the new one comes.
        session.flush()
    if key is None:
        return
    earlier = session.scalar(select(ApiKeyRow).where(ApiKeyRow.secret_sha256 == digest(key)))
    if earlier is not None:
        earlier.revoked = None
        return
    session.add(_row(BOOTSTRAP, Scope.engineer, key, "settings", prefix="(setting)"))


def _valid(session: Session, name: str) -> ApiKeyRow | None:
    return session.scalar(
        select(ApiKeyRow).where(ApiKeyRow.name == name, ApiKeyRow.revoked.is_(None))
    )


def _row(name: str, scope: Scope, key: str, by: str, prefix: str = "") -> ApiKeyRow:
    return ApiKeyRow(
        name=name,
        scope=scope,
        prefix=prefix or key[:PREFIX_LENGTH],
        secret_sha256=digest(key),
        created=utc_now(),
        created_by=by,
    )
