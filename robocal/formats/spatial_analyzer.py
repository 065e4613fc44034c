"""SpatialAnalyzer's ASCII points, joined with a CSV file of joints.

A line holds the point's name in one of four forms, x y z, and what else was ticked at export
(uncertainties, time stamp, offsets, RMS: left out), with spaces or commas between; lines that start
with `//` are remarks. The coordinates stand in SA's working frame, which must be the same for all.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.fields import read_text
from robocal.formats.measured_table import MeasuredTable, MeasurementOptions, length_unit
from robocal.formats.measurements_csv import joint_columns, known_columns, read_joints
from robocal.formats.table import Table, read_table
from robocal.robots.robot import Robot

NAME_FORMS = {"collection-group-target": 3, "group-target": 2, "target": 1, "none": 0}
"""Number of fields before x"""
_POINT = "point"
"""Column of the joints' file that names the point"""
_MAX_BYTES = 400_000_000
_STATED_UNITS = {"millimeter": "mm", "millimetre": "mm", "inch": "inch", "meter": "m", "metre": "m"}
"""Words of a remark, longest first where one holds another"""
_DECIMAL = re.compile(r"[-+]?\d*\.\d*([eE][-+]?\d+)?")


@dataclass(frozen=True)
class _Point:
    line: int
    fields: tuple[str, ...]


def read_spatial_analyzer(path: Path, robot: Robot, options: MeasurementOptions) -> MeasuredTable:
    """Points and the joints at which they were measured.

    The joints' file has the joint columns of `measurements.csv` and, unless points and joints stand
    in the same order, a column `point` with the point's name as SA writes it (`Collection::Group::
    Target`, or from the right as much of it as is there). Its other columns are kept.

    Raises
    ------
    BadInput
        Naming line and field.
    """
    scale = length_unit(options)
    points, remarks = _split(path)
    _check_stated_unit(path.name, remarks, options)
    n_names = _name_fields(path.name, points, options.names)
    places = np.array([_place(path.name, point, n_names) for point in points]) * scale
    names = ["::".join(point.fields[:n_names]) for point in points]
    if options.joints is None:
        raise BadInput("option --joints", "is missing: SA's points carry no joints; give a CSV")
    table = read_table(options.joints)
    table.refuse_unknown((*known_columns(robot), _POINT))
    q = read_joints(table, robot)
    if _POINT in table:
        rows = _rows_by_name(path.name, points, names, table)
        order = "joined by name"
    else:
        if len(points) != len(table.cells):
            reason = f"has {len(table.cells)} rows, {path.name} has {len(points)} points"
            raise BadInput(table.file, f"{reason}; add a column '{_POINT}' to join by name")
        rows = np.arange(len(points))
        order = "joined in order"
    dropped = (*joint_columns(robot), _POINT)
    other = {name: table.text(name) for name in table.header if name not in dropped}
    if n_names:
        other["note_point"] = tuple(names[row] for row in rows)
    note = f"{len(rows)} points in {options.length_unit}, {order}"
    no_angles = np.full((len(rows), 4), np.nan)
    return MeasuredTable(q, places[rows], no_angles, other, notes=(note,))


def _split(path: Path) -> tuple[list[_Point], list[_Point]]:
    """Points and remarks, by line."""
    points, remarks = [], []
    for number, line in enumerate(read_text(path, _MAX_BYTES).splitlines(), 1):
        text = line.strip()
        if text.startswith("//"):
            remarks.append(_Point(number, (text,)))
        elif text:
            words = text.split(",") if "," in text else text.split()
            cells = [word.strip().strip('"') for word in words]
            while len(cells) > 3 and not cells[-1]:
                cells.pop()
            points.append(_Point(number, tuple(cells)))
    if not points:
        raise BadInput(path.name, "has no point")
    return points, remarks


def _check_stated_unit(file: str, remarks: list[_Point], options: MeasurementOptions) -> None:
    """Complain where a remark states another unit than the user."""
    for remark in remarks:
        text = remark.fields[0].lower()
        stated = next((unit for word, unit in _STATED_UNITS.items() if word in text), None)
        if stated is not None and stated != options.length_unit:
            raise BadInput(
                f"{file} line {remark.line}",
                f"says that the unit is {stated}, but --units says {options.length_unit}",
            )


def _name_fields(file: str, points: list[_Point], form: str | None) -> int:
    """How many fields stand before x: as told, or where all lines leave one choice."""
    choice = ", ".join(NAME_FORMS)
    if form is not None:
        if form not in NAME_FORMS:
            raise BadInput("option --names", f"must be one of {choice}, not '{form}'")
        return NAME_FORMS[form]
    fitting = {n for point in points for n in _possible_forms(point)}
    if len(fitting) != 1:
        reason = "more than one form fits" if fitting else "no form fits"
        raise BadInput(
            file, f"has point names that cannot be told apart ({reason}); give --names {choice}"
        )
    return fitting.pop()


def _possible_forms(point: _Point) -> set[int]:
    """Numbers of name fields that a line allows; SA writes coordinates with a decimal point.

    Either the first number with a point is x, or, should a name look like one, the line ends with
    z. Where both can be, the user must say.
    """
    decimal = [bool(_DECIMAL.fullmatch(cell)) for cell in point.fields]
    first = decimal.index(True) if any(decimal) else len(decimal)
    starts = {first, len(decimal) - 3}
    return {n for n in starts if n in NAME_FORMS.values() and decimal[n : n + 3] == [True] * 3}


def _place(file: str, point: _Point, n_names: int) -> Float[Array, "3"]:
    cells = point.fields[n_names : n_names + 3]
    where = f"{file} line {point.line}"
    if len(cells) < 3:
        raise BadInput(where, f"has {len(point.fields)} fields, x y z need {n_names + 3}")
    try:
        place = np.array([float(cell) for cell in cells])
    except ValueError:
        raise BadInput(where, f"x y z must be three numbers, not '{' '.join(cells)}'") from None
    if not np.isfinite(place).all():
        raise BadInput(where, f"x y z must be finite, not '{' '.join(cells)}'")
    return place


def _rows_by_name(file: str, points: list[_Point], names: list[str], table: Table) -> np.ndarray:
    """Index of the point of every row of joints."""
    by_name: dict[str, int] = {}
    for index, name in enumerate(names):
        parts = name.split("::")
        for first in range(len(parts)):
            short = "::".join(parts[first:])
            # A short name that two points share is no name for either.
            by_name[short] = -1 if short in by_name and first else index
        if name in names[:index]:
            raise BadInput(f"{file} line {points[index].line}", f"point '{name}' is there twice")
    rows = [by_name.get(cell) for cell in table.text(_POINT)]
    for line, cell, row in zip(table.lines, table.text(_POINT), rows, strict=True):
        if row is None or row < 0:
            reason = "is not in" if row is None else "names several points of"
            raise BadInput(f"{table.file} line {line}", f"point '{cell}' {reason} {file}")
    return np.array(rows)
