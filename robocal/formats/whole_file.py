"""Result files, written whole or not at all."""

from pathlib import Path

from robocal.errors import BadInput


def write_whole(path: Path, text: str) -> None:
    """Put `text` into a file; a reader sees the old content or the new, never a part.

    Raises
    ------
    BadInput
        If the system does not allow it.
    """
    part = path.with_name(path.name + ".part")
    try:
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise BadInput(str(path), f"cannot be written: {error.strerror}") from None
