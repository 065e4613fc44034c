"""REST: where a slave's base stands in its master's, version by version."""

from typing import Annotated

from fastapi import APIRouter, Body, Header, Query, Response

from service.base_calibrations import transforms
from service.base_calibrations.models import BaseTransform, BaseTransforms, TransformState
from service.dependencies import DatabaseDependency, OnceDependency, PersonDependency, RowNumber
from service.errors import Unusable
from service.etag import tag_of, tagged
from service.parameters.models import Decision

router = APIRouter(prefix="/base-transforms/{name}", tags=["base calibrations"])


@router.get("", response_model=BaseTransform, responses={304: {}})
def get_base_transform(
    name: str,
    database: DatabaseDependency,
    state: TransformState | None = None,
    version: Annotated[RowNumber | None, Query(ge=1)] = None,
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """Return the released transform, or a version or the newest candidate where asked for."""
    if state is not None and version is not None:
        raise Unusable("query: give either state or version, not both.")
    with database.read() as session:
        if version is not None:
            row = transforms.version(session, name, version)
        else:
            row = transforms.newest(session, name, state or TransformState.released)
        body = transforms.shown(row).model_dump_json()
    return tagged(body, tag_of(body), if_none_match)


@router.get("/versions")
def list_base_transforms(name: str, database: DatabaseDependency) -> BaseTransforms:
    """All versions, and who did what to them when; newest first."""
    with database.read() as session:
        return transforms.versions(session, name)


@router.post("/{version}/release", response_model=BaseTransform)
def release_base_transform(
    name: str,
    version: RowNumber,
    once: OnceDependency,
    person: PersonDependency,
    decision: Annotated[Decision | None, Body()] = None,
) -> Response:
    """Let the plant use a candidate."""
    reason = decision.reason if decision else ""
    return once.answer(lambda session: transforms.release(session, name, version, person, reason))


@router.post("/{version}/rollback", response_model=BaseTransform)
def rollback_base_transform(
    name: str,
    version: RowNumber,
    once: OnceDependency,
    person: PersonDependency,
    decision: Annotated[Decision | None, Body()] = None,
) -> Response:
    """Let the plant use a version again that was released before."""
    reason = decision.reason if decision else ""
    return once.answer(lambda session: transforms.rollback(session, name, version, person, reason))
