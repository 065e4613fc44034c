"""CSV tables of numbers with named columns; every complaint names file, line and column."""

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.fields import LARGEST, number_from, read_text
from robocal.formats.whole_file import write_whole

_MAX_BYTES = 400_000_000
_REMARK = "note_"
_OTHER_SEPARATORS = {";": "';'", "\t": "tabs"}
"""What spreadsheets put between columns where the comma is the decimal sign"""


@dataclass(frozen=True)
class Table:
    """Cells of a CSV file as text, with the line that each row stands on."""

    file: str
    header: tuple[str, ...]
    lines: Int[Array, "row"]
    cells: tuple[tuple[str, ...], ...]

    def __contains__(self, column: str) -> bool:
        return column in self.header

    def text(self, column: str) -> tuple[str, ...]:
        """Cells of one column; empty strings where the table has no such column."""
        if column not in self.header:
            return ("",) * len(self.cells)
        position = self.header.index(column)
        return tuple(row[position] for row in self.cells)

    def numbers(self, column: str) -> Float[Array, "row"]:
        """One column as numbers, NaN for empty cells and for a column that is not there.

        Raises
        ------
        BadInput
            If a cell is no number of sensible size.
        """
        values = np.full(len(self.cells), np.nan)
        for row, cell in enumerate(self.text(column)):
            if not cell:
                continue
            try:
                values[row] = number_from(cell)
            except ValueError:
                raise self._bad_cell(row, column, cell) from None
            if not abs(values[row]) < LARGEST:
                raise self._bad_cell(row, column, cell)
        return values

    def complete(self, columns: Sequence[str]) -> Float[Array, "row column"]:
        """Columns as numbers in which no cell may be empty.

        Raises
        ------
        BadInput
            Naming line and column of the first cell that is empty or no finite number.
        """
        values = np.column_stack([self.numbers(column) for column in columns])
        missing = np.argwhere(np.isnan(values))
        if len(missing):
            row, column = missing[0]
            where = f"{self.file} line {self.lines[row]}"
            raise BadInput(where, f"column '{columns[column]}' is empty")
        return np.asarray(values)

    def _bad_cell(self, row: int, column: str, cell: str) -> BadInput:
        return BadInput(
            f"{self.file} line {self.lines[row]}",
            f"column '{column}' must be a number below {LARGEST:g} or empty, not '{cell[:40]}'",
        )

    def require(self, columns: Iterable[str], why: str) -> None:
        """Complain about the first of `columns` that the table lacks.

        Raises
        ------
        BadInput
            Naming the missing column and, where one looks alike, the column that was meant.
        """
        columns = tuple(columns)
        for column in columns:
            if column not in self.header:
                others = [name for name in self.header if name not in columns]
                close = get_close_matches(column, others, n=1, cutoff=0.6)
                hint = f" (found '{close[0]}')" if close else ""
                raise BadInput(f"{self.file} line 1", f"column '{column}' is missing{hint}; {why}")

    def refuse_unknown(self, known: Sequence[str]) -> None:
        """Complain about the first column that is neither known nor a remark.

        Raises
        ------
        BadInput
            Naming the column and how to keep it.
        """
        for column in self.header:
            if column not in known and not column.startswith(_REMARK):
                close = get_close_matches(column, known, n=1, cutoff=0.6)
                hint = f"; did you mean '{close[0]}'?" if close else ""
                raise BadInput(
                    f"{self.file} line 1",
                    f"column '{column}' is not known{hint} "
                    f"(name it '{_REMARK}{column}' to keep it as a remark)",
                )


def read_table(path: Path) -> Table:
    """A CSV file with one header row.

    Raises
    ------
    BadInput
        If it is missing, empty, has no rows, a duplicate header or a row of another length.
    """
    file = path.name
    text = read_text(path, _MAX_BYTES)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        header = tuple(name.strip() for name in next(reader, []))
        _check_header(file, header)
        lines, cells = [], []
        for row in reader:
            if not row or not any(cell.strip() for cell in row):
                continue
            if len(row) != len(header):
                raise BadInput(
                    f"{file} line {reader.line_num}",
                    f"has {len(row)} cells, the header has {len(header)}",
                )
            lines.append(reader.line_num)
            cells.append(tuple(cell.strip() for cell in row))
    except csv.Error as error:
        raise BadInput(f"{file} line {reader.line_num}", f"is not CSV: {error}") from None
    if not cells:
        raise BadInput(file, "has a header but no rows")
    return Table(file, header, np.array(lines), tuple(cells))


def _check_header(file: str, header: tuple[str, ...]) -> None:
    if not any(header):
        raise BadInput(f"{file} line 1", "has no header")
    for separator, name in _OTHER_SEPARATORS.items():
        if len(header) == 1 and separator in header[0]:
            raise BadInput(
                f"{file} line 1",
                f"has its columns separated by {name}: save it as CSV with commas between the "
                "columns and points in the numbers",
            )
    for position, name in enumerate(header):
        if name in header[:position]:
            raise BadInput(f"{file} line 1", f"column '{name}' is there twice")


def write_table(path: Path, columns: Mapping[str, Sequence[str]]) -> None:
    """A CSV file of formatted cells, one header row; whole or not at all.

    Raises
    ------
    BadInput
        If the system does not allow it.
    """
    write_whole(path, table_text(columns))


def table_text(columns: Mapping[str, Sequence[str]]) -> str:
    """A CSV file's text: formatted cells, one header row."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue()
