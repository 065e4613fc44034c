"""REST for engineers: users, keys, and the trail of who did what."""

from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Query, Response
from sqlalchemy.orm import Session

from service.access import keys, people, trail
from service.access.models import (
    Audit,
    AuditLine,
    Key,
    Keys,
    Link,
    MadeKey,
    NewKey,
    NewUser,
    User,
    Users,
)
from service.access.scopes import Scope
from service.db.access_tables import ApiKeyRow, AuditRow, PersonRow
from service.dependencies import (
    AuthenticationDependency,
    CallerDependency,
    DatabaseDependency,
    OnceDependency,
    RowNumber,
)

router = APIRouter(tags=["access"])


@router.get("/users")
def list_users(database: DatabaseDependency) -> Users:
    """Everybody who may or might log in."""
    with database.read() as session:
        return Users(users=[user_shown(row) for row in people.everybody(session)])


@router.post("/users", status_code=HTTPStatus.CREATED, response_model=User)
def create_user(wanted: NewUser, once: OnceDependency, caller: CallerDependency) -> Response:
    """Make a user, who can log in after a one-time link was made and used."""
    return once.answer(
        lambda session: user_shown(people.create(session, wanted.name, wanted.role, caller.who)),
        HTTPStatus.CREATED,
    )


@router.post("/users/{name}/link", status_code=HTTPStatus.CREATED, response_model=Link)
def create_link(name: str, once: OnceDependency) -> Response:
    """Make a one-time link by which the user chooses a password, and end earlier ones."""

    def act(session: Session) -> Link:
        token, expires = people.new_link(session, name)
        return Link(name=name, path=f"/welcome?token={token}", expires=expires)

    return once.answer(
        act, HTTPStatus.CREATED, kept=lambda made: made.model_copy(update={"path": None})
    )


@router.post("/users/{name}/disable", response_model=User)
def disable_user(name: str, once: OnceDependency) -> Response:
    """End a user's access at once; a new link gives it back."""
    return once.answer(lambda session: user_shown(people.disable(session, name)))


@router.get("/keys")
def list_keys(database: DatabaseDependency) -> Keys:
    """All keys, newest first, without the keys themselves."""
    with database.read() as session:
        return Keys(keys=[key_shown(row) for row in keys.all_keys(session)])


@router.post("/keys", status_code=HTTPStatus.CREATED, response_model=MadeKey)
def create_key(wanted: NewKey, once: OnceDependency, caller: CallerDependency) -> Response:
    """Make a key; it is shown in this answer and never again."""

    def act(session: Session) -> MadeKey:
        row, key = keys.create(session, wanted.name, Scope(wanted.scope), caller.who)
        return MadeKey(**key_shown(row).model_dump(), key=key)

    return once.answer(
        act, HTTPStatus.CREATED, kept=lambda made: made.model_copy(update={"key": None})
    )


@router.post("/keys/{key}/revoke", response_model=Key)
def revoke_key(
    key: RowNumber, once: OnceDependency, authentication: AuthenticationDependency
) -> Response:
    """Make a key invalid for good."""
    answer = once.answer(lambda session: key_shown(keys.revoke(session, key)))
    authentication.known.forget()
    return answer


@router.get("/audit")
def read_audit(
    database: DatabaseDependency,
    before: Annotated[RowNumber | None, Query(description="lines older than this one")] = None,
    limit: Annotated[int, Query(ge=1, le=500)] = 100,
) -> Audit:
    """Who changed what, newest first, a page at a time."""
    with database.read() as session:
        found = [audit_line(row) for row in trail.page(session, before, limit)]
    return Audit(lines=found, next_before=found[-1].id if len(found) == limit else None)


def user_shown(row: PersonRow) -> User:
    """Make what may be shown of a person."""
    return User(
        name=row.name,
        role=Scope(row.role),
        has_password=row.password_hash is not None,
        disabled=row.disabled,
        created=row.created,
        created_by=row.created_by,
    )


def key_shown(row: ApiKeyRow) -> Key:
    """Make what may be shown of a key."""
    return Key(
        id=row.id,
        name=row.name,
        scope=Scope(row.scope),
        prefix=row.prefix,
        created=row.created,
        created_by=row.created_by,
        last_used=row.last_used,
        revoked=row.revoked,
    )


def audit_line(row: AuditRow) -> AuditLine:
    """Make one line of the trail as it is shown."""
    return AuditLine(
        id=row.id,
        at=row.at,
        who=row.who,
        action=row.action,
        object=row.object,
        status=row.status,
        address=row.address,
    )
