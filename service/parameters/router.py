"""REST: the parameters that a cell's MES reads."""

import hashlib
from http import HTTPStatus
from typing import Annotated

from fastapi import APIRouter, Header, Query, Response

from service.dependencies import DatabaseDependency, OnceDependency, RowNumber
from service.errors import Unusable
from service.parameters import store
from service.parameters.models import Parameters, ParametersState

router = APIRouter(prefix="/cells/{cell}/parameters", tags=["parameters"])


@router.get("", response_model=Parameters, responses={304: {}})
def get_parameters(
    cell: str,
    database: DatabaseDependency,
    state: ParametersState | None = None,
    version: Annotated[RowNumber | None, Query(ge=1)] = None,
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """Return the released parameters, or a version or the newest candidate where asked for."""
    if state is not None and version is not None:
        raise Unusable("query: give either state or version, not both.")
    with database.read() as session:
        if version is not None:
            row = store.version(session, cell, version)
        else:
            row = store.newest(session, cell, state or ParametersState.released)
        body = store.shown(row).model_dump_json()
    etag = f'"{hashlib.sha256(body.encode()).hexdigest()[:32]}"'
    headers = {"ETag": etag, "Cache-Control": "no-cache"}
    if if_none_match is not None and _matches(etag, if_none_match):
        return Response(status_code=HTTPStatus.NOT_MODIFIED, headers=headers)
    return Response(body, media_type="application/json", headers=headers)


@router.post("/{version}/release", response_model=Parameters)
def release_parameters(cell: str, version: RowNumber, once: OnceDependency) -> Response:
    """Let the MES use a candidate."""
    return once.answer(lambda session: store.release(session, cell, version))


def _matches(etag: str, if_none_match: str) -> bool:
    tags = [tag.strip().removeprefix("W/") for tag in if_none_match.split(",")]
    return "*" in tags or etag in tags
