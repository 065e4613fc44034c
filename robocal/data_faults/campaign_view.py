"""The rows that can show a slip: points of the target that was measured most often."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.formats.bundle import Bundle
from robocal.measurements import MeasurementSet
from robocal.robots.robot import Robot

LEAST_ROWS = 15
"""Fewer points show nothing for certain"""

_LEAST_OF_A_HALF = 10


@dataclass(frozen=True)
class View:
    """Some measurements, each beside the joints that it is thought to belong to."""

    robot: Robot
    rows: MeasurementSet
    measured: Int[Array, "row"]
    """Which measurement."""
    moved: Int[Array, "row"]
    """Which row's joints."""

    def __len__(self) -> int:
        return len(self.measured)

    @property
    def points(self) -> Float[Array, "row 3"]:
        """Measured points [m]."""
        return np.asarray(self.rows.position[self.measured])

    def evenly(self, most: int) -> "View":
        """At most so many rows, evenly spread."""
        if len(self) <= most:
            return self
        chosen = np.linspace(0, len(self) - 1, most).astype(int)
        return self.choose(chosen)

    def choose(self, chosen: Int[Array, "some"]) -> "View":
        """Some of the rows."""
        return View(self.robot, self.rows, self.measured[chosen], self.moved[chosen])

    def shifted(self, source: Int[Array, "every"]) -> "View":
        """Measurements with the joints of other rows, -1 for those that have none."""
        found = source[self.measured]
        kept = found >= 0
        return View(self.robot, self.rows, self.measured[kept], found[kept])

    def halves(self) -> tuple["View", ...]:
        """The first and the last half; one of them is whole if rows slip at one place."""
        half = (len(self) + 1) // 2
        if half < _LEAST_OF_A_HALF:
            return (self,)
        every = np.arange(len(self))
        return (self.choose(every[:half]), self.choose(every[-half:]))


def view_of(bundle: Bundle) -> View | None:
    """The rows of the target that was measured most often; None if its points are too few."""
    chosen = np.flatnonzero(on_main_target(bundle))
    if len(np.unique(bundle.measurements.position[chosen], axis=0)) < LEAST_ROWS:
        return None
    return View(bundle.robot, bundle.measurements, chosen, chosen)


def on_main_target(bundle: Bundle) -> Bool[Array, "row"]:
    """Rows with a point of the target on the tool that has most of them."""
    rows = bundle.measurements
    fixed = {name for name, target in bundle.targets.items() if target.fixed}
    located = np.isfinite(rows.position[:, 0])
    names = np.array(rows.target)
    usable: Bool[Array, "row"] = located & ~np.isin(names, list(fixed))
    if not usable.any():
        return usable
    main, _ = Counter(names[usable].tolist()).most_common(1)[0]
    return np.asarray(usable & (names == main))


def file_order(bundle: Bundle) -> Int[Array, "row"]:
    """Number of each row in the file, rows that cannot be used counted too."""
    lines = bundle.measurements.lines
    every = np.sort(np.concatenate([lines, [row.line for row in bundle.rejected]]).astype(int))
    order: Int[Array, "row"] = np.searchsorted(every, lines)
    return order
