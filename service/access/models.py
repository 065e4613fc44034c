"""Access as it goes over HTTP."""

import re
from typing import Annotated, Literal

from pydantic import BaseModel, Field, SecretStr, StringConstraints

from service.access.caller import CallerKind
from service.access.scopes import Scope
from service.cells.models import Strict
from service.plain_text import PlainText

_PERSON_NAME = r"^[a-z0-9][a-z0-9_.-]{0,62}$"
_KEY_NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}$"
PersonName = Annotated[str, StringConstraints(pattern=_PERSON_NAME)]
"""Small letters only: two people must not differ by a capital."""
KeyName = Annotated[str, StringConstraints(pattern=_KEY_NAME)]
Password = Annotated[SecretStr, Field(min_length=1, max_length=200)]
Role = Literal[Scope.operate, Scope.engineer]
KeyScope = Literal[Scope.read, Scope.operate, Scope.engineer]
Token = Annotated[SecretStr, Field(min_length=1, max_length=200)]


def is_person_name(name: str) -> bool:
    """Whether a person can be named so."""
    return re.fullmatch(_PERSON_NAME, name) is not None


def is_key_name(name: str) -> bool:
    """Whether a key can be named so."""
    return re.fullmatch(_KEY_NAME, name) is not None


class LogIn(Strict):
    """Name and password."""

    name: Annotated[PlainText, Field(min_length=1, max_length=63)]
    password: Password


class Welcome(Strict):
    """A one-time link is used."""

    token: Token
    name: PersonName | None = None
    """Of the first engineer; anybody else has one."""
    password: Password


class NewPassword(Strict):
    """A person changes the own password."""

    old: Password
    new: Password


class Me(BaseModel):
    """Who the service takes the caller for."""

    kind: CallerKind
    name: str
    scope: Scope
    csrf_token: str
    """To be sent as X-CSRF-Token with changes; empty unless a person is logged in."""


class NewUser(Strict):
    """A person who shall be able to log in."""

    name: PersonName
    role: Role


class User(BaseModel):
    """A person who may log in."""

    name: str
    role: Scope
    has_password: bool
    disabled: bool
    created: str
    created_by: str


class Users(BaseModel):
    """Everybody."""

    users: list[User]


class Link(BaseModel):
    """A one-time link by which a person chooses a password."""

    name: str
    path: str | None
    """Shown once; null when the same request is answered again."""
    expires: str


class NewKey(Strict):
    """A key to be made."""

    name: KeyName
    scope: KeyScope


class Key(BaseModel):
    """A key of a program, without the key itself."""

    id: int
    name: str
    scope: Scope
    prefix: str
    created: str
    created_by: str
    last_used: str | None
    revoked: str | None


class MadeKey(Key):
    """A key as it is shown once."""

    key: str | None
    """Null when the same request is answered again."""


class Keys(BaseModel):
    """All keys."""

    keys: list[Key]


class AuditLine(BaseModel):
    """One deed."""

    id: int
    at: str
    who: str
    action: str
    object: str
    status: int
    address: str


class Audit(BaseModel):
    """A page of the trail, newest first."""

    lines: list[AuditLine]
    next_before: int | None
    """`?before=` of the next page; null on the last one."""
