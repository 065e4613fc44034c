"""Keys and users by command, for whoever may read the database: the way in when nobody can log in.

Each change is in the audit trail under the name of the account that ran the command.
"""

import getpass
from collections.abc import Iterator
from contextlib import contextmanager
from http import HTTPStatus

from sqlalchemy.orm import Session

from robocal.errors import BadInput
from service.access import keys, people, trail
from service.access.scopes import Scope
from service.db.engine import Database, open_database
from service.errors import Problem
from service.settings import Settings
from service.start_up import prepare_database


@contextmanager
def _database(settings: Settings) -> Iterator[Database]:
    prepare_database(settings)
    database = open_database(settings.database_url, settings.busy_s)
    try:
        yield database
    finally:
        database.close()


@contextmanager
def _change(settings: Settings, action: str, what: str) -> Iterator[Session]:
    """One change with its line in the trail; a refusal becomes one line for the person."""
    with _database(settings) as database:
        try:
            with database.write() as session:
                yield session
                trail.record(session, _who(), f"robocal {action}", what, HTTPStatus.OK)
        except Problem as problem:
            raise BadInput(action, str(problem)) from None


def add_key(settings: Settings, name: str, scope: Scope) -> str:
    """Make a key and return it; raises `BadInput` if a valid one has the name."""
    with _change(settings, "key add", name) as session:
        return keys.create(session, name, scope, _who())[1]


def revoke_key(settings: Settings, name: str) -> None:
    """Make a key invalid; raises `BadInput` if there is none of that name."""
    with _change(settings, "key revoke", name) as session:
        keys.revoke(session, keys.by_name(session, name).id)


def key_lines(settings: Settings) -> list[str]:
    """One line for every key, newest first."""
    with _database(settings) as database, database.read() as session:
        return [
            f"{row.name:24}{row.scope:10}{row.prefix}…  created {row.created[:16]} by "
            f"{row.created_by}, last used {(row.last_used or 'never')[:16]}"
            + (f", revoked {row.revoked[:16]}" if row.revoked else "")
            for row in keys.all_keys(session)
        ]


def add_user(settings: Settings, name: str, role: Scope) -> str:
    """Make a user, and return the one-time link; raises `BadInput`."""
    with _change(settings, "user add", name) as session:
        people.create(session, name, role, _who())
        return _address(settings, people.new_link(session, name)[0])


def link_user(settings: Settings, name: str) -> str:
    """Return a new one-time link, by which a lost password is replaced."""
    with _change(settings, "user link", name) as session:
        return _address(settings, people.new_link(session, name)[0])


def disable_user(settings: Settings, name: str) -> None:
    """End a user's access at once; raises `BadInput`."""
    with _change(settings, "user disable", name) as session:
        people.disable(session, name)


def user_lines(settings: Settings) -> list[str]:
    """One line for everybody."""
    with _database(settings) as database, database.read() as session:
        return [
            f"{row.name:24}{row.role:10}"
            + ("disabled" if row.disabled else "active" if row.password_hash else "no password yet")
            for row in people.everybody(session)
        ]


def _address(settings: Settings, token: str) -> str:
    """Where this machine finds the link, by the settings of this command."""
    scheme = "http" if settings.tls_cert is None else "https"
    host = settings.hosts[0] if settings.hosts else f"{settings.host}:{settings.port}"
    return f"{scheme}://{host}/welcome?token={token}"


def _who() -> str:
    return f"command {getpass.getuser()}"
