"""Unpack an uploaded bundle without trusting it: names, links, sizes are checked while reading."""

import stat
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import IO

from service.campaigns.measurements import CAMPAIGN, MEASUREMENTS, ROBOT
from service.errors import Unusable

_CHUNK = 1 << 16
_RATIO_COUNTS_FROM = 1 << 20
"""A small file may compress well; a bomb does so at size [bytes]."""
_NEEDED = (CAMPAIGN, MEASUREMENTS)
_ENCRYPTED = 0x1
_METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""The others unpack a whole block at once, however large, before its size can be judged."""
_LONGEST_NAME = 255
"""Of a file in most file systems [bytes]."""
_UNREADABLE = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    NotImplementedError,
    # A stated offset may lie before the start of the file or past all numbers.
    OSError,
    ValueError,
    OverflowError,
)


@dataclass(frozen=True)
class UnpackLimits:
    """How much an archive may hold."""

    total_bytes: int
    ratio: float
    """Unpacked over packed size of one file."""
    files: int


def unpack(upload: IO[bytes], limits: UnpackLimits) -> dict[str, bytes]:
    """Return the files of a bundle by name.

    Raises
    ------
    Unusable
        With one sentence, when the archive is none, is hostile or lacks a file.
    """
    try:
        with zipfile.ZipFile(upload) as archive:
            files = _read_all(archive, limits)
    except _UNREADABLE as error:
        raise Unusable(
            f"The upload is not a readable .zip ({error}); send the bundle's folder zipped."
        ) from error
    files = _without_common_folder(files)
    missing = [name for name in _NEEDED if name not in files]
    if missing:
        raise Unusable(
            f"The .zip lacks {' and '.join(missing)}; a bundle holds {ROBOT}, {CAMPAIGN} "
            f"and {MEASUREMENTS}."
        )
    return files


def _read_all(archive: zipfile.ZipFile, limits: UnpackLimits) -> dict[str, bytes]:
    entries = [entry for entry in archive.infolist() if not (entry.is_dir() or _of_finder(entry))]
    if len(entries) > limits.files:
        raise Unusable(f"The .zip holds {len(entries)} files; a bundle has at most {limits.files}.")
    files: dict[str, bytes] = {}
    room = limits.total_bytes
    for entry in entries:
        _check_entry(entry)
        name = str(PurePosixPath(entry.filename))
        if name in files:
            raise Unusable(f"The .zip holds '{name}' twice.")
        files[name] = _read_one(archive, entry, room, limits)
        room -= len(files[name])
    return files


def _of_finder(entry: zipfile.ZipInfo) -> bool:
    """Whether macOS added the entry by itself when a person zipped a folder."""
    parts = PurePosixPath(entry.filename).parts
    return bool(parts) and (parts[0] == "__MACOSX" or parts[-1] == ".DS_Store")


def _check_entry(entry: zipfile.ZipInfo) -> None:
    # `orig_filename` because zipfile cuts names at a zero byte and turns other separators.
    name = entry.orig_filename
    path = PurePosixPath(name)
    outside = path.is_absolute() or ".." in path.parts or ":" in name or "\\" in name
    if outside or "\0" in name or not name.isprintable():
        raise Unusable(f"The .zip holds {name!r}, a name that leads outside the bundle's folder.")
    if not path.parts or any(len(part.encode()) > _LONGEST_NAME for part in path.parts):
        raise Unusable(f"The .zip holds '{name[:40]}', which no file can be named.")
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in {0, stat.S_IFREG}:
        raise Unusable(f"The .zip holds {name!r}, which is a link or device, not a plain file.")
    if entry.flag_bits & _ENCRYPTED:
        raise Unusable(f"The .zip holds {name!r}, which is encrypted; send it without a password.")
    if entry.compress_type not in _METHODS:
        raise Unusable(
            f"The .zip holds {name!r}, packed by method {entry.compress_type}; "
            "send it packed by the usual one (deflate) or not at all."
        )


def _read_one(
    archive: zipfile.ZipFile, entry: zipfile.ZipInfo, room: int, limits: UnpackLimits
) -> bytes:
    content = bytearray()
    with archive.open(entry) as packed:
        # The sizes that the archive states are claims; only what comes out counts.
        while chunk := packed.read(_CHUNK):
            content += chunk
            if len(content) > room:
                raise Unusable(
                    f"The .zip unpacks to more than {limits.total_bytes / 1e6:g} MB "
                    f"(at '{entry.filename}'); a bundle is never that large."
                )
            ratio = len(content) / max(entry.compress_size, 1)
            if len(content) > _RATIO_COUNTS_FROM and ratio > limits.ratio:
                raise Unusable(
                    f"The .zip unpacks '{entry.filename}' to over {limits.ratio:g} times its "
                    "packed size; that is no measured data."
                )
    return bytes(content)


def _without_common_folder(files: dict[str, bytes]) -> dict[str, bytes]:
    """Zipping a folder puts its name before every file."""
    folders = {PurePosixPath(name).parts[:-1] for name in files}
    if len(folders) != 1:
        return files
    return {PurePosixPath(name).name: content for name, content in files.items()}
