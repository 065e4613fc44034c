"""What the service answers when it cannot do what it was asked: problem+json, RFC 9457."""

import logging
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from types import MappingProxyType
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel
from sqlalchemy.exc import DatabaseError, DataError, DBAPIError, InternalError, OperationalError
from starlette.exceptions import HTTPException

from service.db.trouble import Trouble, is_damaged, trouble_of

log = logging.getLogger("robocal.service")

_OF_THE_DATABASE = (OperationalError, InternalError, DataError)
_STATUS_OF = {
    Trouble.disk_full: HTTPStatus.INSUFFICIENT_STORAGE,
    Trouble.disk_broken: HTTPStatus.INSUFFICIENT_STORAGE,
    Trouble.damaged: HTTPStatus.SERVICE_UNAVAILABLE,
    Trouble.read_only: HTTPStatus.SERVICE_UNAVAILABLE,
    Trouble.unsuitable: HTTPStatus.UNPROCESSABLE_ENTITY,
    Trouble.busy: HTTPStatus.SERVICE_UNAVAILABLE,
}


class ProblemDocument(BaseModel):
    """The body of every error answer."""

    type: str = "about:blank"
    title: str
    status: int
    detail: str


class Problem(Exception):
    """A refused request; the message is one clear sentence."""

    status = HTTPStatus.INTERNAL_SERVER_ERROR
    headers: Mapping[str, str] = MappingProxyType({})

    def answer(self) -> JSONResponse:
        """Make the error answer."""
        answer = problem_answer(self.status, str(self))
        answer.headers.update(self.headers)
        return answer


class NotFound(Problem):
    """What was asked for does not exist."""

    status = HTTPStatus.NOT_FOUND


class Unauthorised(Problem):
    """Nobody is known to have sent the request."""

    status = HTTPStatus.UNAUTHORIZED
    headers = MappingProxyType({"WWW-Authenticate": "Bearer"})


class Forbidden(Problem):
    """The caller is known, and may not do this."""

    status = HTTPStatus.FORBIDDEN


class Conflict(Problem):
    """The request is well formed but does not fit the present state."""

    status = HTTPStatus.CONFLICT


class Unusable(Problem):
    """The request, or the file it brought, has an error in its content."""

    status = HTTPStatus.UNPROCESSABLE_ENTITY


def problem_answer(status: int, detail: str) -> JSONResponse:
    """Make the error answer with one sentence."""
    # What the caller sent may be repeated in it; one line it stays.
    sentence = " ".join(detail.split())
    document = ProblemDocument(title=HTTPStatus(status).phrase, status=status, detail=sentence)
    return JSONResponse(
        document.model_dump(), status_code=status, media_type="application/problem+json"
    )


def _is_trouble(error: Exception) -> bool:
    return isinstance(error, _OF_THE_DATABASE) or is_damaged(error)


def install(app: FastAPI) -> None:
    """Answer every error of the application as problem+json."""

    def refused(request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, Problem)
        return error.answer()

    def malformed(request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, RequestValidationError)
        return problem_answer(HTTPStatus.UNPROCESSABLE_ENTITY, _sentence(error.errors()))

    def http_error(request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, HTTPException)
        answer = problem_answer(
            error.status_code, f"{request.method} {request.url.path}: {error.detail}."
        )
        answer.headers.update(error.headers or {})
        return answer

    def troubled(request: Request, error: Exception) -> JSONResponse:
        # Whatever else the database complains of is a fault of the code.
        if not _is_trouble(error):
            raise error
        assert isinstance(error, DBAPIError)
        trouble = trouble_of(error)
        log.error("%s %s: %s (%s)", request.method, request.url.path, trouble, error.orig)
        return problem_answer(_STATUS_OF[trouble], trouble)

    def broken(request: Request, error: Exception) -> JSONResponse:
        # What stands before the routes meets the database as well.
        if _is_trouble(error):
            return troubled(request, error)
        return problem_answer(
            HTTPStatus.INTERNAL_SERVER_ERROR,
            f"{request.method} {request.url.path} failed inside the service "
            f"({type(error).__name__}); the service's log has the details.",
        )

    app.add_exception_handler(Problem, refused)
    app.add_exception_handler(RequestValidationError, malformed)
    app.add_exception_handler(HTTPException, http_error)
    app.add_exception_handler(DatabaseError, troubled)
    app.add_exception_handler(Exception, broken)


def _sentence(errors: Sequence[Any]) -> str:
    faults = []
    for error in errors:
        place, *path = error["loc"]
        field = ".".join(str(part) for part in path)
        faults.append(f"{place} {field}: {error['msg']}" if field else f"{place}: {error['msg']}")
    return "; ".join(faults) + "."
