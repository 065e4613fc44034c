"""Profiles: YAML files that say how a device of a family is wired, its registers or its lines.

A profile of the package is chosen by its name, one's own by the path of its file. Every field is
checked when the profile is read, and an error names file and field.
"""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml

from drivers.errors import Refused

FOLDER = "profiles"
SUFFIX = ".yaml"


class Profile:
    """The fields of one profile, or of a section of one; each must be asked for."""

    def __init__(self, device: str, where: str, fields: Mapping[str, Any]) -> None:
        self.device = device
        self._where = where
        self._fields = fields
        self._asked: set[str] = set()

    def has(self, name: str) -> bool:
        """Whether an optional field is there."""
        return name in self._fields

    def number(self, name: str) -> float:
        """Read a field that must be a finite number."""
        value = self._value(name)
        if isinstance(value, bool) or not isinstance(value, int | float) or value != value:
            raise self.wrong(name, f"is {value!r} and not a number")
        return float(value)

    def whole(self, name: str, lowest: int, highest: int) -> int:
        """Read a field that must be a whole number within limits."""
        value = self._value(name)
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.wrong(name, f"is {value!r} and not a whole number")
        if not lowest <= value <= highest:
            raise self.wrong(name, f"is {value} and not within {lowest} to {highest}")
        return value

    def word(self, name: str) -> str:
        """Read a field that must be text."""
        value = self._value(name)
        if not isinstance(value, str) or not value:
            raise self.wrong(name, f"is {value!r} and not text")
        return value

    def choice(self, name: str, *allowed: str) -> str:
        """Read a field that must be one of some words."""
        value = self.word(name)
        if value not in allowed:
            raise self.wrong(name, f"is {value!r} and not one of {', '.join(allowed)}")
        return value

    def wholes(self, name: str) -> tuple[int, ...]:
        """Read a field that must be a list of whole numbers."""
        value = self._value(name)
        if not isinstance(value, list) or any(type(entry) is not int for entry in value):
            raise self.wrong(name, f"is {value!r} and not a list of whole numbers")
        return tuple(value)

    def words(self, name: str) -> tuple[str, ...]:
        """Read a field that must be a list of words."""
        value = self._value(name)
        if not isinstance(value, list) or any(not isinstance(entry, str) for entry in value):
            raise self.wrong(name, f"is {value!r} and not a list of words")
        return tuple(value)

    def words_by_code(self, name: str) -> dict[int, str]:
        """Read a field that must map whole numbers to words."""
        value = self._value(name)
        if not isinstance(value, dict) or not all(
            type(code) is int and isinstance(text, str) for code, text in value.items()
        ):
            raise self.wrong(name, "does not map whole numbers to words")
        return dict(value)

    def words_by_name(self, name: str) -> dict[str, str]:
        """Read a field that must map words to words."""
        value = self._value(name)
        if not isinstance(value, dict) or not all(
            isinstance(key, str) and isinstance(text, str) for key, text in value.items()
        ):
            raise self.wrong(name, "does not map words to words")
        return dict(value)

    def section(self, name: str) -> Profile:
        """Read a field that must have fields of its own."""
        value = self._value(name)
        if not isinstance(value, dict):
            raise self.wrong(name, "has no fields")
        return Profile(self.device, f"{self._where}, {name}", value)

    def end(self) -> None:
        """Check that every field was asked for, so that a misspelt one is not overlooked."""
        unknown = sorted(set(map(str, self._fields)) - self._asked)
        if unknown:
            raise self.wrong(
                unknown[0], f"is not known; known are {', '.join(sorted(self._asked))}"
            )

    def wrong(self, name: str, what: str) -> Refused:
        """Make the error that says what is wrong with a field."""
        return Refused(
            self.device, "read profile", f"{self._where}: field {name} {what}; correct the profile"
        )

    def _value(self, name: str) -> Any:  # noqa: ANN401 - straight from YAML
        self._asked.add(name)
        if name not in self._fields:
            raise self.wrong(name, "is missing")
        return self._fields[name]


def read_profile(device: str, name: str) -> Profile:
    """Read a profile by its name in the package, or by the path of a file.

    Raises
    ------
    Refused
        If there is none, or it is not a YAML file with fields.
    """
    own = name.endswith((SUFFIX, ".yml"))
    source = Path(name) if own else files("drivers") / FOLDER / f"{name}{SUFFIX}"
    if not source.is_file():
        known = ", ".join(profile_names())
        raise Refused(
            device,
            "read profile",
            f"there is no profile {name!r}; name a file that ends with {SUFFIX} or one of: {known}",
        )
    try:
        fields = yaml.safe_load(source.read_text(encoding="utf-8"))
    except yaml.YAMLError as fault:
        raise Refused(device, "read profile", f"{name} is not YAML: {fault}") from fault
    if not isinstance(fields, dict):
        raise Refused(device, "read profile", f"{name} has no fields; see the package's profiles")
    return Profile(device, f"profile {name}", fields)


def profile_names() -> list[str]:
    """Names of the package's profiles."""
    folder = files("drivers") / FOLDER
    return sorted(
        entry.name.removesuffix(SUFFIX) for entry in folder.iterdir() if entry.name.endswith(SUFFIX)
    )
