"""REST: joints for wanted poses, from the parameters that the MES may use."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from service.cells import store as cells
from service.compensation.compensate import compensate_poses
from service.compensation.models import CompensatedJoints, CompensationRequest
from service.dependencies import DatabaseDependency, OnceDependency, RowNumber
from service.parameters import store as parameters
from service.parameters.models import ParametersState

router = APIRouter(prefix="/cells/{cell}/compensate", tags=["parameters"])


@router.post("", response_model=CompensatedJoints)
def compensate_targets(
    cell: str,
    request: CompensationRequest,
    database: DatabaseDependency,
    once: OnceDependency,
    version: Annotated[RowNumber | None, Query(ge=1)] = None,
) -> Response:
    """Return the joints that really reach the wanted poses, by the released parameters."""
    earlier = once.earlier()
    if earlier is not None:
        return earlier
    with database.read() as session:
        if version is None:
            row = parameters.newest(session, cell, ParametersState.released)
        else:
            row = parameters.version(session, cell, version)
        number, model = row.version, row.document["model"]
        settings = cells.settings_of(cells.find(session, cell))
    found = compensate_poses(settings, number, model, request)
    return once.answer(lambda session: found)
