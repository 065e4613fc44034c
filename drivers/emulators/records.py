"""Frozen dataclasses made of JSON or YAML entries, with an error that names the field."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any, TypeVar

T = TypeVar("T")


class WorldError(Exception):
    """A request or a configuration that the world cannot follow.

    `word` is the machine-readable kind of error in the world protocol.
    """

    def __init__(self, word: str, message: str) -> None:
        super().__init__(message)
        self.word = word


def build(kind: type[T], entries: Mapping[str, Any], where: str) -> T:
    """Make a dataclass of JSON entries, lists becoming tuples; name what is unknown or missing."""
    known = {f.name: f for f in fields(kind)}  # type: ignore[arg-type]
    for name in entries:
        if name not in known:
            raise WorldError("config", f"{where}: unknown field {name}, known: {sorted(known)}.")
    for name, f in known.items():
        required = f.default is MISSING and f.default_factory is MISSING
        if required and name not in entries:
            raise WorldError("config", f"{where}: field {name} is missing.")
    return kind(**{k: tuple(v) if isinstance(v, list) else v for k, v in entries.items()})
