"""Answers that a client may keep and ask for again with If-None-Match (RFC 9110, 13.1.2)."""

import hashlib
from http import HTTPStatus

from fastapi import Response


def tag_of(body: str) -> str:
    """Return the strong tag of a body."""
    return f'"{hashlib.sha256(body.encode()).hexdigest()[:32]}"'


def tagged(body: str, etag: str, if_none_match: str | None) -> Response:
    """Answer with JSON and its ETag, or say that what the client has is still true."""
    headers = {"ETag": etag, "Cache-Control": "no-cache"}
    if if_none_match is not None:
        tags = [tag.strip().removeprefix("W/") for tag in if_none_match.split(",")]
        if "*" in tags or etag in tags:
            return Response(status_code=HTTPStatus.NOT_MODIFIED, headers=headers)
    return Response(body, media_type="application/json", headers=headers)
