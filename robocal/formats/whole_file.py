"""Result files, written whole or not at all."""

from collections.abc import Mapping
from pathlib import Path

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
    parts = {path: path.with_name(path.name + ".part") for path in texts}
    for path, part in parts.items():
        if path.is_dir() or part.is_dir():
            raise BadInput(str(path), "cannot be written: a folder is in its place")
    try:
        for path, text in texts.items():
            parts[path].write_text(text, encoding="utf-8")
        for path, part in parts.items():
            part.replace(path)
    except OSError as error:
        for part in parts.values():
            part.unlink(missing_ok=True)
        raise BadInput(str(path), f"cannot be written: {error.strerror}") from None
