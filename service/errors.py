"""What the service answers when it cannot do what it was asked: problem+json, RFC 9457."""

from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import BaseModel
from sqlalchemy.exc import OperationalError
from starlette.exceptions import HTTPException


class ProblemDocument(BaseModel):
    """The body of every error answer."""

    type: str = "about:blank"
    title: str
    status: int
    detail: str


class Problem(Exception):
    """A refused request; the message is one clear sentence."""

    status = HTTPStatus.INTERNAL_SERVER_ERROR


class NotFound(Problem):
    """What was asked for does not exist."""

    status = HTTPStatus.NOT_FOUND


class Conflict(Problem):
    """The request is well formed but does not fit the present state."""

    status = HTTPStatus.CONFLICT


class Unusable(Problem):
    """The request, or the file it brought, has an error in its content."""

    status = HTTPStatus.UNPROCESSABLE_ENTITY


def problem_answer(status: int, detail: str) -> JSONResponse:
    """Make the error answer with one sentence."""
    document = ProblemDocument(title=HTTPStatus(status).phrase, status=status, detail=detail)
    return JSONResponse(
        document.model_dump(), status_code=status, media_type="application/problem+json"
    )


def install(app: FastAPI) -> None:
    """Answer every error of the application as problem+json."""

    def refused(request: Request, error: Exception) -> JSONResponse:
        assert isinstance(error, Problem)
        return problem_answer(error.status, str(error))

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

    def locked(request: Request, error: Exception) -> JSONResponse:
        return problem_answer(
            HTTPStatus.SERVICE_UNAVAILABLE,
            "The database does not answer at this moment; send the request again.",
        )

    def broken(request: Request, error: Exception) -> JSONResponse:
        return problem_answer(
            HTTPStatus.INTERNAL_SERVER_ERROR,
            f"{request.method} {request.url.path} failed inside the service "
            f"({type(error).__name__}); the service's log has the details.",
        )

    app.add_exception_handler(Problem, refused)
    app.add_exception_handler(RequestValidationError, malformed)
    app.add_exception_handler(HTTPException, http_error)
    app.add_exception_handler(OperationalError, locked)
    app.add_exception_handler(Exception, broken)


def _sentence(errors: Sequence[Any]) -> str:
    faults = []
    for error in errors:
        place, *path = error["loc"]
        field = ".".join(str(part) for part in path)
        faults.append(f"{place} {field}: {error['msg']}" if field else f"{place}: {error['msg']}")
    return "; ".join(faults) + "."
