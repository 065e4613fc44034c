"""REST: the parameters that a cell's MES reads, and what a person decides about them."""

from typing import Annotated

from fastapi import APIRouter, Body, Depends, Header, Query, Request, Response

from service.dependencies import (
    DatabaseDependency,
    OnceDependency,
    PageSize,
    PersonDependency,
    RowNumber,
)
from service.errors import Unusable
from service.etag import tagged
from service.parameters import history, life, store
from service.parameters.answers import Answers
from service.parameters.models import Decision, History, Parameters, ParametersState, Versions


async def _answers(request: Request) -> Answers:
    answers: Answers = request.app.state.parameter_answers
    return answers


AnswersDependency = Annotated[Answers, Depends(_answers)]

router = APIRouter(prefix="/cells/{cell}/parameters", tags=["parameters"])


@router.get("", response_model=Parameters, responses={304: {}})
def get_parameters(
    cell: str,
    database: DatabaseDependency,
    answers: AnswersDependency,
    state: ParametersState | None = None,
    version: Annotated[RowNumber | None, Query(ge=1)] = None,
    if_none_match: Annotated[str | None, Header()] = None,
) -> Response:
    """Return the released parameters, or a version or the newest in a state where asked for."""
    if state is not None and version is not None:
        raise Unusable("query: give either state or version, not both.")
    with database.read() as session:
        if version is not None:
            row = store.version(session, cell, version)
        else:
            row = store.newest(session, cell, state or ParametersState.released)
        answer = answers.of(row)
    return tagged(answer.body, answer.etag, if_none_match)


@router.get("/versions")
def list_versions(
    cell: str,
    database: DatabaseDependency,
    state: ParametersState | None = None,
    before: Annotated[RowNumber | None, Query(description="versions older than this one")] = None,
    limit: PageSize = 50,
) -> Versions:
    """All versions without their numbers, newest first, a page at a time."""
    with database.read() as session:
        return store.page(session, cell, state, before, limit)


@router.get("/history")
def get_history(
    cell: str,
    database: DatabaseDependency,
    version: RowNumber | None = None,
    before: Annotated[RowNumber | None, Query(description="steps older than this one")] = None,
    limit: PageSize = 50,
) -> History:
    """Who did what to which version, when and from which readings, newest first."""
    with database.read() as session:
        return history.page(session, cell, version, before, limit)


@router.post("/{version}/release", response_model=Parameters)
def release_parameters(
    cell: str,
    version: RowNumber,
    once: OnceDependency,
    person: PersonDependency,
    decision: Annotated[Decision | None, Body()] = None,
) -> Response:
    """Let the MES use a verified version, or with a reason an unverified one."""
    reason = decision.reason if decision else ""
    return once.answer(lambda session: life.release(session, cell, version, person, reason))


@router.post("/{version}/rollback", response_model=Parameters)
def rollback_parameters(
    cell: str,
    version: RowNumber,
    once: OnceDependency,
    person: PersonDependency,
    decision: Annotated[Decision | None, Body()] = None,
) -> Response:
    """Let the MES use a version again that was released before."""
    reason = decision.reason if decision else ""
    return once.answer(lambda session: life.rollback(session, cell, version, person, reason))
