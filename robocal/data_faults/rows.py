"""Slips of the row order: measurements that belong to the joints of another row.

The station and the robot write their rows apart; one reading too many or too few, and from there on
each measurement stands beside the wrong joints. Seen row by row against predicted points.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.data_faults.slip import Fault, Slip
from robocal.measurements import MeasurementSet

MOST_ROWS = 5
"""Largest shift that is tried"""
SHIFTS = tuple(range(-MOST_ROWS, MOST_ROWS + 1))
_CHANGE_COST = 2.5
"""Rows that a new shift must explain before it is believed"""
_START_COST = 2.0
"""The same where the file begins with it; a little less, as the one shift tells all then"""
_TIE = 1e-6
"""A row more of shift has to explain more than this"""
_MOST_FLAGGED = 60
_MEASURED = ("position", "orientation", "distance", "target", "lines", "time", "temperature")
"""Fields that come from the station; the others come from the robot."""

Predicted = Callable[[Int[Array, "some"], Int[Array, "some"]], Float[Array, "some"]]
"""Distance [m] of measurements from where the joints of other rows put them; NaN if unknown."""


@dataclass(frozen=True)
class OtherJoints:
    """Row i takes the joints of row `source[i]`, by line; rows whose source is 0 are left out."""

    source: dict[int, int]

    def __call__(self, rows: MeasurementSet) -> MeasurementSet:
        """The rows with their own joints."""
        row_of_line = {int(line): row for row, line in enumerate(rows.lines)}
        source = np.array([
            row_of_line.get(self.source.get(int(line), int(line)), -1) for line in rows.lines
        ])
        kept = source >= 0
        mended = rows.rows(kept)
        moved = {
            field.name: getattr(rows, field.name)[source[kept]]
            for field in fields(rows)
            if field.name not in _MEASURED
        }
        return replace(mended, **moved)


def find_row_slips(
    order: Int[Array, "row"],
    lines: Int[Array, "row"],
    seen: Bool[Array, "row"],
    distance: Predicted,
    tolerance: float,
) -> tuple[Slip, ...]:
    """Shifts and exchanges among the rows.

    Parameters
    ----------
    order
        Number of each row in the file, rows that cannot be used counted too.
    lines
        Its line.
    seen
        Rows whose point can be predicted.
    distance
        Distances between measurements and the points of other rows' joints.
    tolerance
        Distance that a right row may have [m].
    """
    every = np.arange(len(order))
    own = distance(every, every)
    flagged = seen & ~(own <= tolerance)
    if not flagged.any():
        return ()
    shift = np.zeros(len(order), dtype=int)
    if np.count_nonzero(flagged) > _CHANGE_COST:
        shift = _follow_shifts(order, distance, seen, tolerance)
    slips = _shift_slips(order, lines, shift)
    rest = np.flatnonzero(flagged & (shift == 0))
    return (*slips, *_exchange_slips(lines, rest, distance, own, tolerance))


def partners(order: Int[Array, "row"], shift: Int[Array, "row"]) -> Int[Array, "row"]:
    """Row whose joints belong to each measurement: `shift` rows earlier in the file; -1 if none."""
    wanted = order - shift
    place = np.clip(np.searchsorted(order, wanted), 0, len(order) - 1)
    return np.asarray(np.where(order[place] == wanted, place, -1))


def _follow_shifts(
    order: Int[Array, "row"],
    distance: Predicted,
    seen: Bool[Array, "row"],
    tolerance: float,
) -> Int[Array, "row"]:
    """The cheapest sequence of shifts along the file, by dynamic programming."""
    n = len(order)
    cost = np.zeros((n, len(SHIFTS)))
    own = MOST_ROWS
    # The row itself first: one whose joints are not in the file is no reason to change a shift.
    for state in sorted(range(len(SHIFTS)), key=lambda state: abs(SHIFTS[state])):
        source = partners(order, np.full(n, SHIFTS[state]))
        cost[:, state] = cost[:, own]
        rows = np.flatnonzero(seen & (source >= 0))
        relative = distance(rows, source[rows]) / tolerance
        cost[rows, state] = np.minimum(np.nan_to_num(relative, nan=1.0) ** 2, 1.0)
    # The row itself is believed before a neighbour that fits as well, a near one before a far.
    cost += _TIE * np.abs(SHIFTS)
    came_from = np.zeros((n, len(SHIFTS)), dtype=int)
    total = cost[0] + np.where(np.arange(len(SHIFTS)) == own, 0.0, _START_COST)
    for row in range(1, n):
        best = int(np.argmin(total))
        change = total[best] + _CHANGE_COST
        came_from[row] = np.where(total <= change, np.arange(len(SHIFTS)), best)
        total = np.minimum(total, change) + cost[row]
    states = np.empty(n, dtype=int)
    states[-1] = np.argmin(total)
    for row in range(n - 1, 0, -1):
        states[row - 1] = came_from[row, states[row]]
    return states - MOST_ROWS


def _shift_slips(
    order: Int[Array, "row"], lines: Int[Array, "row"], shift: Int[Array, "row"]
) -> tuple[Slip, ...]:
    """One slip for all runs of shifted rows: each takes the joints as they stand in the file."""
    source = partners(order, shift)
    starts = np.flatnonzero(np.diff(shift, prepend=shift[0] + 1))
    parts, moved = [], {}
    for first, after in zip(starts, [*starts[1:], len(shift)], strict=True):
        by = int(shift[first])
        if by == 0:
            continue
        parts.append(_shift_sentence(lines, int(first), int(after), by))
        for row in range(first, after):
            moved[int(lines[row])] = int(lines[source[row]]) if source[row] >= 0 else 0
    if not parts:
        return ()
    return (Slip(Fault.row_shift, (), "; ".join(parts), OtherJoints(moved), tuple(moved)),)


def _shift_sentence(lines: Int[Array, "row"], first: int, after: int, by: int) -> str:
    where = f"from line {lines[first]} on"
    if first == 0 and after == len(lines):
        where = "in every line"
    elif after < len(lines):
        where = f"from line {lines[first]} to line {lines[after - 1]}"
    count = f"{abs(by)} row{'s' if abs(by) > 1 else ''}"
    return (
        f"{where} the measurements belong to the joints {count} "
        f"{'earlier' if by > 0 else 'later'}: move the measurements "
        f"{'up' if by > 0 else 'down'} by {count}"
    )


def _exchange_slips(
    lines: Int[Array, "row"],
    rest: Int[Array, "some"],
    distance: Predicted,
    own: Float[Array, "row"],
    tolerance: float,
) -> tuple[Slip, ...]:
    """Pairs of bad rows that are both good once exchanged."""
    rest = rest[np.argsort(-np.nan_to_num(own[rest], nan=0.0))][:_MOST_FLAGGED]
    a, b = np.triu_indices(len(rest), 1)
    a, b = rest[a], rest[b]
    worst = np.maximum(distance(a, b), distance(b, a))
    good = np.flatnonzero(worst < 0.5 * np.minimum(own[a], own[b]))
    good = good[worst[good] <= tolerance]
    slips: list[Slip] = []
    used: set[int] = set()
    for pair in good[np.argsort(worst[good])]:
        first, second = sorted((int(a[pair]), int(b[pair])))
        if used & {first, second}:
            continue
        used |= {first, second}
        i, j = int(lines[first]), int(lines[second])
        sentence = f"the measurements of lines {i} and {j} are exchanged: exchange them back"
        slips.append(Slip(Fault.swapped_rows, (), sentence, OtherJoints({i: j, j: i}), (i, j)))
    return tuple(slips)
