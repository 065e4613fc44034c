"""Receive an uploaded file without holding it in memory, raw or as a form."""

import hashlib
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import IO

import anyio.to_thread
from fastapi import Request
from starlette.datastructures import UploadFile
from starlette.types import Message, Receive

from service.errors import Unusable

_IN_MEMORY_BYTES = 1 << 20
_CHUNK = 1 << 16


@dataclass(frozen=True)
class Upload:
    """The bytes that came, rewound, and their hash."""

    file: IO[bytes]
    sha256: str


@asynccontextmanager
async def received(request: Request, limit_bytes: int) -> AsyncIterator[Upload]:
    """Return the one file of a request: its body, or the first file of a multipart form."""
    bounded = Request(request.scope, _bounded(request, limit_bytes))
    if request.headers.get("content-type", "").startswith("multipart/form-data"):
        async with bounded.form(max_files=1, max_fields=8) as form:
            files = [part for part in form.values() if isinstance(part, UploadFile)]
            if not files:
                raise Unusable("The form brings no file; send the bundle's .zip as its file.")
            yield await anyio.to_thread.run_sync(_rewound, files[0].file)
        return
    with tempfile.SpooledTemporaryFile(max_size=_IN_MEMORY_BYTES) as spool:
        async for chunk in bounded.stream():
            spool.write(chunk)
        yield await anyio.to_thread.run_sync(_rewound, spool)


def _bounded(request: Request, limit_bytes: int) -> Receive:
    total = 0

    async def receive() -> Message:
        nonlocal total
        message = await request.receive()
        total += len(message.get("body", b""))
        if total > limit_bytes:
            raise Unusable(f"The upload is larger than {limit_bytes / 1e6:g} MB; send a bundle.")
        return message

    return receive


def _rewound(file: IO[bytes]) -> Upload:
    file.seek(0)
    digest = hashlib.sha256()
    while chunk := file.read(_CHUNK):
        digest.update(chunk)
    file.seek(0)
    return Upload(file, digest.hexdigest())
