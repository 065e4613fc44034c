"""Style, scripts and plotly.js, served compressed under an address that changes with content."""

import gzip
import hashlib
import re
from dataclasses import dataclass
from functools import cache
from http import HTTPStatus
from importlib.metadata import distribution
from pathlib import Path

from fastapi import Request, Response

from service.errors import NotFound

STATIC = Path(__file__).parent / "static"
PLOTLY = "plotly"
PAGES = "pages"
_PLOTLY_FILE = "plotly/package_data/plotly.min.js"
_STYLE_MARK = re.compile(r'getElementById\("([0-9a-f]{64})"\)')
_MEDIA_TYPES = {
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
}
# A year: the address of other content is another one.
_FOREVER = "public, max-age=31536000, immutable"
_DIGITS = 16


@dataclass(frozen=True)
class Asset:
    """One file as it goes over the wire."""

    content: bytes
    compressed: bytes
    media_type: str
    etag: str


@dataclass(frozen=True)
class Collection:
    """Files with one version, so that scripts import each other by relative addresses."""

    name: str
    version: str
    files: dict[str, Path]

    def address(self, file: str) -> str:
        """Return where a page finds one of the files."""
        assert file in self.files, f"no file {file} in {self.name}"
        return f"/assets/{self.name}/{self.version}/{file}"


@cache
def collection(name: str) -> Collection:
    """Return the files under a name; raises `NotFound`."""
    if name == PAGES:
        files = {path.name: path for path in sorted(STATIC.iterdir())}
    elif name == PLOTLY:
        path = Path(str(distribution("plotly").locate_file(_PLOTLY_FILE)))
        files = {path.name: path}
    else:
        raise NotFound(f"There are no assets named '{name}'.")
    digest = hashlib.sha256()
    for file, path in files.items():
        digest.update(f"{file}\n".encode() + path.read_bytes())
    return Collection(name, digest.hexdigest()[:_DIGITS], files)


@cache
def asset(path: Path) -> Asset:
    """Read and compress a file once: plotly.js takes a quarter of a second."""
    content = path.read_bytes()
    digest = hashlib.sha256(content).hexdigest()[:_DIGITS]
    return Asset(
        content=content,
        compressed=gzip.compress(content, compresslevel=9, mtime=0),
        media_type=_MEDIA_TYPES[path.suffix],
        etag=f'"{digest}"',
    )


@cache
def style_marks() -> tuple[str, ...]:
    """Return the elements that plotly.js looks for before it makes a style of its own.

    Such a style (that of maps, which no page here draws) is forbidden by the pages' policy; where
    the element is there already, plotly.js leaves it.
    """
    (path,) = collection(PLOTLY).files.values()
    return tuple(_STYLE_MARK.findall(path.read_text(encoding="utf-8")))


def answer(request: Request, name: str, version: str, file: str) -> Response:
    """Answer a request for one file; raises `NotFound` for an outdated version too."""
    found = collection(name)
    if version != found.version or file not in found.files:
        raise NotFound(f"There is no asset {name}/{version}/{file}; load the page again.")
    wanted = asset(found.files[file])
    headers = {
        "ETag": wanted.etag,
        "Cache-Control": _FOREVER,
        "Vary": "Accept-Encoding",
        "X-Content-Type-Options": "nosniff",
    }
    if request.headers.get("if-none-match") == wanted.etag:
        return Response(status_code=HTTPStatus.NOT_MODIFIED, headers=headers)
    if "gzip" not in request.headers.get("accept-encoding", ""):
        return Response(wanted.content, media_type=wanted.media_type, headers=headers)
    return Response(
        wanted.compressed,
        media_type=wanted.media_type,
        headers=headers | {"Content-Encoding": "gzip"},
    )
