"""Rows under the column names of measurements.csv."""

import csv
import io
from dataclasses import dataclass

Value = float | int | str | None


@dataclass(frozen=True)
class MeasurementTable:
    """Rows under column names of measurements.csv."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Value, ...], ...]

    def csv(self) -> str:
        """Return the text of measurements.csv."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(self.rows)
        return text.getvalue()

    def objects(self) -> list[dict[str, Value]]:
        """One mapping per row."""
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]
