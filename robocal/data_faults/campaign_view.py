"""The rows that can show a slip: points of the targets on the tool."""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.formats.bundle import Bundle
from robocal.measurements import MeasurementSet
from robocal.robots.robot import Robot

LEAST_POSES = 15
"""Fewer poses of one target show nothing for certain"""
_LEAST_NUMBERS = 3 * LEAST_POSES - 3
"""What so many poses show, whatever the place of the target"""
_LEAST_TO_MISS = 12
"""5 poses of one target; fewer fit nearly any arm, and one bad point decides"""
_LEAST_OF_A_HALF = 18
"""7 poses of one target; what a half shows has to hold for all rows"""
_MOST_TARGETS = 8
"""Further ones cost time and tell little; their rows are judged all the same"""
_SAME_JOINTS = 4
"""Decimals of joint readings that tell poses apart [rad or m]; [1]"""
_OF_A_BODY = np.array([0, 3, 5, 6])
"""Numbers that 0, 1, 2 or more points of one body show of its pose"""


@dataclass(frozen=True)
class View:
    """Some measurements, each beside the joints that it is thought to belong to."""

    robot: Robot
    rows: MeasurementSet
    target: Int[Array, "every"]
    """Number of the target of every row; -1 for those that no view takes."""
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

    @property
    def places(self) -> Int[Array, "row"]:
        """Number of the target of each measurement."""
        return np.asarray(self.target[self.measured])

    @property
    def tells_slips(self) -> bool:
        """Whether there are poses enough to tell one slip from another."""
        return self.numbers >= _LEAST_NUMBERS

    @property
    def can_miss(self) -> bool:
        """Whether there are so many poses that a wrong robot misses them."""
        return self.numbers >= _LEAST_TO_MISS

    @property
    def numbers(self) -> int:
        """Measured numbers that the places of the targets leave over.

        Targets of one pose keep their distances, whatever is wrong with the joints.
        """
        joints = np.round(self.rows.joints[self.moved], _SAME_JOINTS)
        pose = np.unique(joints, axis=0, return_inverse=True)[1].ravel()
        shown = np.unique(np.column_stack([pose, self.places]), axis=0)
        n_targets = len(np.unique(self.places))
        each = np.bincount(shown[:, 0])
        rigid = _OF_A_BODY[np.minimum(each, 3)].sum() - _OF_A_BODY[min(n_targets, 3)]
        return min(int(rigid), 3 * (len(shown) - n_targets))

    def evenly(self, most: int) -> "View":
        """At most so many rows, spread over the file."""
        if len(self) <= most:
            return self
        if (self.places == self.places[0]).all():
            return self.choose(np.linspace(0, len(self) - 1, most).astype(int))
        # Even steps could keep time with the order of the targets, and miss some.
        chosen = np.random.default_rng(0).choice(len(self), most, replace=False)
        return self.choose(np.sort(chosen))

    def choose(self, chosen: Int[Array, "some"]) -> "View":
        """Some of the rows."""
        return View(self.robot, self.rows, self.target, self.measured[chosen], self.moved[chosen])

    def shifted(self, source: Int[Array, "every"]) -> "View":
        """Measurements with the joints of other rows, -1 for those that have none."""
        found = source[self.measured]
        kept = found >= 0
        return View(self.robot, self.rows, self.target, self.measured[kept], found[kept])

    def halves(self) -> tuple["View", ...]:
        """The first and the last half; one of them is whole if rows slip at one place."""
        half = (len(self) + 1) // 2
        every = np.arange(len(self))
        both = (self.choose(every[:half]), self.choose(every[-half:]))
        if min(one.numbers for one in both) < _LEAST_OF_A_HALF:
            return (self,)
        return both


def view_of(bundle: Bundle) -> View | None:
    """The points of the targets on the tool; None without any."""
    rows = bundle.measurements
    names = np.array(rows.target)
    target = np.full(len(rows), -1)
    for number, name in enumerate(targets_on_tool(bundle)[:_MOST_TARGETS]):
        target[_located(bundle) & (names == name)] = number
    chosen = np.flatnonzero(target >= 0)
    return View(bundle.robot, rows, target, chosen, chosen) if len(chosen) else None


def targets_on_tool(bundle: Bundle) -> tuple[str, ...]:
    """Names of the targets on the tool that have points, those with most of them first."""
    names = np.array(bundle.measurements.target)
    return tuple(name for name, _ in Counter(names[_located(bundle)].tolist()).most_common())


def on_main_target(bundle: Bundle) -> Bool[Array, "row"]:
    """Rows with a point of the target on the tool that has most of them."""
    names = np.array(bundle.measurements.target)
    usable = _located(bundle)
    return np.asarray(usable & (names == targets_on_tool(bundle)[0])) if usable.any() else usable


def on_tool(bundle: Bundle) -> Bool[Array, "row"]:
    """Rows of the tool or of a nest that it carries."""
    fixed = [name for name, target in bundle.targets.items() if target.fixed]
    return np.asarray(~np.isin(np.array(bundle.measurements.target), fixed))


def _located(bundle: Bundle) -> Bool[Array, "row"]:
    """Rows with a point of any target on the tool."""
    return np.asarray(np.isfinite(bundle.measurements.position[:, 0]) & on_tool(bundle))


def file_order(bundle: Bundle) -> Int[Array, "row"]:
    """Number of each row in the file, rows that cannot be used counted too."""
    lines = bundle.measurements.lines
    every = np.sort(np.concatenate([lines, [row.line for row in bundle.rejected]]).astype(int))
    order: Int[Array, "row"] = np.searchsorted(every, lines)
    return order
