"""Faults of the data that a seed puts into a table: no physics, wrong bookkeeping."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drivers.emulators.measured_rows import Rows
from drivers.emulators.true_arm import Vector

FIRST_LINE = 2
"""Line of measurements.csv that holds the first row."""
QUATERNION = ("qw", "qx", "qy", "qz")


@dataclass(frozen=True)
class Spoilt:
    """A table with a fault, and what a diagnosis ought to say of it."""

    rows: Rows
    fault: str
    lines: tuple[int, ...]
    """Empty where every row is wrong."""


def _joints(rows: Rows) -> list[str]:
    return [name for name in rows.columns if name[0] == "j" and name[1].isdigit()]


def _measured(rows: Rows) -> list[str]:
    return [name for name in ("x_mm", "y_mm", "z_mm", *QUATERNION) if name in rows.columns]


def _lines(first: int, last: int) -> tuple[int, ...]:
    return tuple(range(first + FIRST_LINE, last + FIRST_LINE))


def outlier(rows: Rows, draw: np.random.Generator) -> Spoilt:
    """Three readings are off by 0.3 to 5 mm."""
    hit = np.sort(draw.choice(np.flatnonzero(np.array(rows.split) == "fit"), 3, replace=False))
    way = draw.normal(size=(3, 3))
    size = np.exp(draw.uniform(np.log(0.3), np.log(5.0), 3))
    way *= (size / np.linalg.norm(way, axis=1))[:, None]
    changed = {}
    for axis, name in enumerate(("x_mm", "y_mm", "z_mm")):
        changed[name] = rows.columns[name].copy()
        changed[name][hit] += way[:, axis]
    return Spoilt(rows.with_columns(**changed), "outlier", tuple(int(k) + FIRST_LINE for k in hit))


def row_shift(rows: Rows, draw: np.random.Generator) -> Spoilt:
    """From one row on every measurement stands one row too low."""
    first = int(draw.integers(len(rows) // 4, 3 * len(rows) // 4))
    source = np.arange(len(rows))
    source[first:] -= 1
    moved = {name: rows.columns[name][source] for name in _measured(rows)}
    return Spoilt(rows.with_columns(**moved), "row_shift", _lines(first, len(rows)))


def swapped_rows(rows: Rows, draw: np.random.Generator) -> Spoilt:
    """Two rows have each other's measurement."""
    a, b = np.sort(draw.choice(len(rows), 2, replace=False))
    source = np.arange(len(rows))
    source[[a, b]] = b, a
    moved = {name: rows.columns[name][source] for name in _measured(rows)}
    return Spoilt(
        rows.with_columns(**moved), "swapped_rows", (int(a) + FIRST_LINE, int(b) + FIRST_LINE)
    )


def unit(rows: Rows, draw: np.random.Generator) -> Spoilt:
    """Angles in radians, or positions in metres or inches."""
    factors = [
        dict.fromkeys([n for n in _joints(rows) if n.endswith("_deg")], np.pi / 180.0),
        dict.fromkeys(("x_mm", "y_mm", "z_mm"), 1e-3),
        dict.fromkeys(("x_mm", "y_mm", "z_mm"), 1.0 / 25.4),
    ]
    chosen = factors[int(draw.integers(len(factors)))]
    scaled = {name: rows.columns[name] * factor for name, factor in chosen.items()}
    return Spoilt(rows.with_columns(**scaled), "unit", ())


def angle_convention(rows: Rows, draw: np.random.Generator) -> Spoilt:
    """One joint, neither the first nor the last, counts from another zero."""
    names = [name for name in _joints(rows)[1:-1] if name.endswith("_deg")]
    name = str(draw.choice(names))
    turned = rows.columns[name] + float(draw.choice([-90.0, 90.0]))
    return Spoilt(rows.with_columns(**{name: turned}), "angle_convention", ())


def joint_sign(rows: Rows, draw: np.random.Generator) -> Spoilt:
    """One joint counts the other way."""
    name = str(draw.choice(_joints(rows)))
    return Spoilt(rows.with_columns(**{name: -rows.columns[name]}), "joint_sign", ())


def mirrored_frame(rows: Rows, draw: np.random.Generator) -> Spoilt:
    """One axis of the instrument is turned round, positions only."""
    name = str(draw.choice(["x_mm", "y_mm", "z_mm"]))
    return Spoilt(rows.with_columns(**{name: -rows.columns[name]}), "mirrored_frame", ())


def wrong_joint_source(rows: Rows, draw: np.random.Generator) -> Spoilt:
    """Two joints of the same kind stand in each other's column."""
    turning = [name for name in _joints(rows) if name.endswith("_deg")]
    a, b = (str(name) for name in draw.choice(turning, 2, replace=False))
    exchanged = {a: rows.columns[b], b: rows.columns[a]}
    return Spoilt(rows.with_columns(**exchanged), "wrong_joint_source", ())


def quaternion_order(rows: Rows, draw: np.random.Generator) -> Spoilt:
    """The scalar part stands last instead of first."""
    del draw
    moved: dict[str, Vector] = {
        name: rows.columns[source]
        for name, source in zip(QUATERNION, (*QUATERNION[1:], QUATERNION[0]), strict=True)
    }
    return Spoilt(rows.with_columns(**moved), "quaternion_order", ())


SLIPS: dict[str, Callable[[Rows, np.random.Generator], Spoilt]] = {
    spoil.__name__: spoil
    for spoil in (
        outlier,
        row_shift,
        swapped_rows,
        unit,
        angle_convention,
        joint_sign,
        mirrored_frame,
        wrong_joint_source,
        quaternion_order,
    )
}


def slips_of(rows: Rows) -> list[str]:
    """Faults that this table can have."""
    turned = QUATERNION[0] in rows.columns
    only_positions = {"mirrored_frame"}
    only_poses = {"quaternion_order"}
    hidden = only_positions if turned else only_poses
    return [name for name in SLIPS if name not in hidden]
