"""Texts that people give and others read: one line, in which nothing works unseen.

A control character breaks the line. A bidirectional override turns the letters that follow around,
in the rest of the page or of the log as well, so that another text is read than was stored; see
Boucher and Anderson, *Trojan Source*, USENIX Security 2023. What merely looks odd is left alone.
"""

import unicodedata
from collections.abc import Iterator
from typing import Annotated, TypeVar

from pydantic import AfterValidator, BaseModel

Model = TypeVar("Model", bound=BaseModel)

_CONTROL = "Cc"
_TURNING = {chr(code) for code in (*range(0x202A, 0x202F), *range(0x2066, 0x206A))}
"""Embeddings, overrides and isolates, with what ends them."""


def plain(text: str) -> str:
    """Give the text back; raises `ValueError` at a character that works unseen."""
    for character in text:
        if character in _TURNING or unicodedata.category(character) == _CONTROL:
            code = f"U+{ord(character):04X}"
            raise ValueError(f"must hold neither control nor direction characters; take out {code}")
    return text


PlainText = Annotated[str, AfterValidator(plain)]


def all_plain(model: Model) -> Model:
    """Give a request's body back; raises `ValueError` that names the first unfit text.

    For models from which stored documents are read too: what was stored stays readable.
    """
    for place, text in _texts(model.model_dump(mode="json"), ""):
        try:
            plain(text)
        except ValueError as error:
            raise ValueError(f"{place} {error}") from error
    return model


def _texts(value: object, place: str) -> Iterator[tuple[str, str]]:
    if isinstance(value, str):
        yield place, value
    elif isinstance(value, list):
        for number, entry in enumerate(value):
            yield from _texts(entry, f"{place}.{number}")
    elif isinstance(value, dict):
        for key, entry in value.items():
            yield f"a key of {place}", key
            yield from _texts(entry, f"{place}.{key}".removeprefix("."))
