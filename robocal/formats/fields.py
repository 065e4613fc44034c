"""YAML mappings read field by field, so that every complaint names file, line and field."""

from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput

_MAX_BYTES = 4_000_000
_DEEPEST = 30
"""Levels of nesting; no file of ours has more than six, and the parser recurses; [1]"""
LARGEST = 1e15
"""Numbers of this size and above are slips; their squares would overflow; any unit"""
LEAST_DEVIATION = 1e-9
"""Standard deviations below it are slips; their squares would underflow [mm, mrad, deg or ppm]"""


class Fields:
    """One mapping of a YAML file. Getters mark their field as known; `finish` names the rest."""

    def __init__(self, file: str, node: yaml.Node, path: str) -> None:
        self._file = file
        self._path = path
        self.line = node.start_mark.line + 1
        if not isinstance(node, yaml.MappingNode):
            raise BadInput(f"{file} line {self.line}", f"{path or 'the file'} must be a mapping")
        self._nodes: dict[str, yaml.Node] = {}
        self._asked: set[str] = set()
        for key, value in node.value:
            name = str(key.value)
            if name in self._nodes:
                raise BadInput(
                    f"{file} line {key.start_mark.line + 1}", f"field '{self._full(name)}' is twice"
                )
            self._nodes[name] = value

    def _full(self, name: str) -> str:
        return f"{self._path}.{name}" if self._path else name

    def error(self, name: str, reason: str) -> BadInput:
        """A complaint about field `name` (or about the mapping where it has no such field)."""
        node = self._nodes.get(name)
        line = self.line if node is None else node.start_mark.line + 1
        return BadInput(f"{self._file} line {line}", f"field '{self._full(name)}' {reason}")

    def _node(self, name: str) -> yaml.Node:
        self._asked.add(name)
        if name not in self._nodes:
            raise self.error(name, "is missing")
        return self._nodes[name]

    def __contains__(self, name: str) -> bool:
        self._asked.add(name)
        return name in self._nodes

    def names(self) -> Iterator[str]:
        """All field names, in order; marks them as known."""
        self._asked.update(self._nodes)
        return iter(self._nodes)

    def text(self, name: str, default: str | None = None) -> str:
        """A string."""
        if default is not None and name not in self:
            return default
        node = self._node(name)
        if not isinstance(node, yaml.ScalarNode):
            raise self.error(name, "must be text")
        return str(node.value)

    def number(self, name: str, default: float | None = None) -> float:
        """A finite number."""
        if default is not None and name not in self:
            return default
        return self._number(name, self._node(name))

    def _number(self, name: str, node: yaml.Node) -> float:
        value = node.value if isinstance(node, yaml.ScalarNode) else ""
        try:
            number = number_from(value)
        except ValueError:
            raise self.error(name, f"must be a number, not '{value}'") from None
        if not abs(number) < float("inf"):
            raise self.error(name, f"must be a finite number, not '{value}'")
        if abs(number) >= LARGEST:
            raise self.error(name, f"must be smaller than {LARGEST:g}, not '{value}'")
        return number

    def deviation(self, name: str, default: float | None = None) -> float:
        """A standard deviation that a weight can be made of."""
        number = self.number(name, default)
        if number < LEAST_DEVIATION:
            least = f"must be positive, {LEAST_DEVIATION:g} or more, not {number:g}"
            raise self.error(name, least)
        return number

    def whole_number(self, name: str, default: int) -> int:
        """A whole number that is not negative."""
        number = self.number(name, float(default))
        if number < 0 or number != int(number):
            raise self.error(name, f"must be a whole number from 0 on, not {number:g}")
        return int(number)

    def flag(self, name: str, *, default: bool) -> bool:
        """`true` or `false`."""
        if name not in self:
            return default
        value = self.text(name)
        if value.lower() not in ("true", "false"):
            raise self.error(name, f"must be true or false, not '{value}'")
        return value.lower() == "true"

    def numbers(self, name: str, count: int | None) -> tuple[float, ...]:
        """A list of finite numbers, `count` of them unless None."""
        node = self._node(name)
        if not isinstance(node, yaml.SequenceNode):
            raise self.error(name, "must be a list of numbers")
        if count is not None and len(node.value) != count:
            raise self.error(name, f"must have {count} numbers, not {len(node.value)}")
        return tuple(self._number(name, entry) for entry in node.value)

    def matrix(self, name: str, rows: int, columns: int) -> tuple[tuple[float, ...], ...]:
        """A list of `rows` lists of `columns` numbers."""
        node = self._node(name)
        if not isinstance(node, yaml.SequenceNode) or len(node.value) != rows:
            raise self.error(name, f"must be a list of {rows} rows")
        table = []
        for row in node.value:
            if not isinstance(row, yaml.SequenceNode) or len(row.value) != columns:
                raise self.error(name, f"must have {columns} numbers in every row")
            table.append(tuple(self._number(name, entry) for entry in row.value))
        return tuple(table)

    def texts(self, name: str) -> tuple[str, ...]:
        """A list of strings."""
        node = self._node(name)
        if not isinstance(node, yaml.SequenceNode) or not all(
            isinstance(entry, yaml.ScalarNode) for entry in node.value
        ):
            raise self.error(name, "must be a list of names")
        return tuple(str(entry.value) for entry in node.value)

    def number_rows(self, name: str, rows: int, columns: int) -> Float[Array, "row column"]:
        """A list of `rows` texts of `columns` finite numbers each, apart by blanks."""
        texts = self.texts(name)
        if len(texts) != rows:
            raise self.error(name, f"must be a list of {rows} rows")
        table = np.empty((rows, columns))
        for row, text in zip(table, texts, strict=True):
            cells = text.split()
            if len(cells) != columns:
                raise self.error(name, f"must have {columns} numbers in every row")
            try:
                row[:] = [number_from(cell) for cell in cells]
            except ValueError as error:
                raise self.error(name, f"must hold numbers alone: {error}") from None
        if not np.isfinite(table).all():
            raise self.error(name, "must hold finite numbers")
        return table

    def is_empty_list(self, name: str) -> bool:
        """Whether the field is a list without entries."""
        node = self._node(name)
        return isinstance(node, yaml.SequenceNode) and not node.value

    def mapping(self, name: str) -> "Fields":
        """A nested mapping."""
        return Fields(self._file, self._node(name), self._full(name))

    def mappings(self, name: str) -> list["Fields"]:
        """A list of mappings."""
        node = self._node(name)
        if not isinstance(node, yaml.SequenceNode) or not node.value:
            raise self.error(name, "must be a list with at least one entry")
        return [
            Fields(self._file, entry, f"{self._full(name)}[{position + 1}]")
            for position, entry in enumerate(node.value)
        ]

    def finish(self) -> None:
        """Complain about the first field that nobody asked for."""
        for name in self._nodes:
            if name not in self._asked:
                close = get_close_matches(name, self._asked, n=1)
                hint = f"; did you mean '{close[0]}'?" if close else ""
                raise self.error(name, f"is not known{hint}")


def number_from(text: str) -> float:
    """A number as files write it; Python's own 1_000 is not one.

    Raises
    ------
    ValueError
        If it is none.
    """
    if "_" in text:
        raise ValueError(text)
    return float(text)


class _Loader(yaml.SafeLoader):
    """Composes nodes, and refuses to follow a file down without end."""

    _depth = 0

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:  # noqa: ANN401
        if self._depth == _DEEPEST:
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            problem = f"nested deeper than {_DEEPEST} levels"
            raise yaml.MarkedYAMLError(problem=problem, problem_mark=mark)
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node


def read_fields(path: Path) -> Fields:
    """The top mapping of a YAML file.

    Raises
    ------
    BadInput
        If the file cannot be read, is no YAML, or is no mapping.
    """
    return fields_of(path.name, read_text(path))


def fields_of(file: str, text: str) -> Fields:
    """The top mapping of YAML text that stands in `file`."""
    try:
        node = yaml.compose(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        line = mark.line + 1 if mark else 1
        raise BadInput(f"{file} line {line}", f"is not valid YAML: {error.problem}") from None
    except yaml.YAMLError as error:
        raise BadInput(file, f"is not valid YAML: {str(error).splitlines()[0]}") from None
    if node is None:
        raise BadInput(file, "is empty")
    return Fields(file, node, "")


def read_text(path: Path, max_bytes: int = _MAX_BYTES) -> str:
    """Content of a text file in UTF-8.

    Raises
    ------
    BadInput
        If the file is missing, unreadable, larger than `max_bytes` or not UTF-8.
    """
    try:
        if path.exists() and not path.is_file():
            raise BadInput(path.name, "is not a regular file")
        if path.stat().st_size > max_bytes:
            raise BadInput(path.name, f"is larger than {max_bytes / 1e6:.0f} MB")
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise BadInput(str(path), "no such file") from None
    except UnicodeDecodeError as error:
        raise BadInput(path.name, f"is not UTF-8 text (byte {error.start})") from None
    except OSError as error:
        raise BadInput(str(path), f"cannot be read: {error.strerror}") from None
