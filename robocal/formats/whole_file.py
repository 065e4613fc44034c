"""Result files, written whole or not at all."""

from collections.abc import Mapping
from pathlib import Path
from threading import get_native_id

from robocal.errors import BadInput


def write_whole(path: Path, text: str) -> None:
    """Put `text` into a file; a reader sees the old content or the new, never a part.

    Raises
    ------
    BadInput
        If the system does not allow it.
    """
    write_together({path: text})


def write_together(texts: Mapping[Path, str]) -> None:
    """Write files that belong together: where one of them cannot be written, none is.

    Raises
    ------
    BadInput
        If the system does not allow it.
    """
    places = {path: place_of(path) for path in texts}
    parts = {path: part_of(place) for path, place in places.items()}
    try:
        for path, text in texts.items():
            parts[path].write_text(text, encoding="utf-8")
        for path, part in parts.items():
            part.replace(places[path])
    except OSError as error:
        raise BadInput(str(path), f"cannot be written: {error.strerror}") from None
    finally:
        # Whoever stops the program in here finds no parts either.
        for part in parts.values():
            part.unlink(missing_ok=True)


def part_of(place: Path) -> Path:
    """Where a file's content stands until all of it is there: each writer has its own place."""
    return place.with_name(f"{place.name}.{get_native_id()}.part")


def place_of(path: Path) -> Path:
    """Where a file is to be put: what a link points to, so that the link stays.

    Only a plain file is ever replaced: to put one in the place of /dev/null would break a system.

    Raises
    ------
    BadInput
        If a folder or anything else that is no plain file is there.
    """
    try:
        if not path.name or path.is_dir():
            raise BadInput(str(path), "cannot be written: a folder is in its place")
        if (path.exists() or path.is_symlink()) and not path.is_file():
            raise BadInput(str(path), "cannot be written: what is in its place is no plain file")
    except OSError as error:
        raise BadInput(str(path), f"cannot be written: {error.strerror}") from None
    return path.resolve()
