"""Random poses that a robot may take in its cell: in range, clear of everything, seen."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.errors import BadInput, NoAnswer
from robocal.planning.cell import Cell
from robocal.planning.constraints import judge
from robocal.robots.robot import Robot

WIDEST = np.pi
"""Joints that turn further than this either way are planned within it: cables [rad]"""
_MARGIN = 0.02
"""Share of each joint's range kept free at both ends, so that a pose can be approached from either
side; [1]"""
_MOST_DRAWN = 1000
"""Random poses per pose wanted after which the request counts as infeasible"""
_BATCH = 4000
REMEDIES = {
    "workspace box": "make the box larger",
    "floor": "set it lower, or state no floor where the arm may reach below its base",
    "self-collision": "make the radius of the links smaller, or narrow the joints' limits",
    "tracker range": "move the station, or widen its range",
    "target acceptance": "turn the target towards the tracker, or widen what it accepts",
    "line of sight": "move the station",
}
"""What to do about each bound"""
UNBOUND = Cell()
"""Only the floor at the robot's base and the arm itself are in the way"""


@dataclass
class _Tally:
    """How many random poses each bound removes."""

    drawn: int = 0
    kept: int = 0
    removed: dict[str, int] = field(default_factory=dict)
    alone: dict[str, int] = field(default_factory=dict)
    """Removed by this bound and by no other."""

    def count(self, judged: dict[str, Bool[Array, "pose"]]) -> Bool[Array, "pose"]:
        """Take a batch in; returns the poses that keep every bound."""
        broken = np.array([~kept for kept in judged.values()])
        times = broken.sum(axis=0)
        for name, breaks in zip(judged, broken, strict=True):
            self.removed[name] = self.removed.get(name, 0) + int(breaks.sum())
            self.alone[name] = self.alone.get(name, 0) + int((breaks & (times == 1)).sum())
        self.drawn += len(times)
        self.kept += int((times == 0).sum())
        return np.asarray(times == 0)

    def in_words(self) -> str:
        """The worst bound first, and what to do about it."""
        worst = sorted(self.removed, key=lambda name: (-self.alone[name], -self.removed[name]))
        removals = "; ".join(
            f"{name} removes {self.removed[name]} ({self.alone[name]} alone)"
            for name in worst
            if self.removed[name]
        )
        return f"{removals}. Most is removed by {worst[0]}: {REMEDIES[worst[0]]}"


def draw_candidates(
    robot: Robot, count: int, rng: np.random.Generator, cell: Cell = UNBOUND
) -> Float[Array, "pose joint"]:
    """So many admissible joint readings, uniform in the joint ranges.

    Raises
    ------
    BadInput
        If the workspace box has no inside.
    NoAnswer
        If fewer than one random pose in a thousand is admissible; says which bound of the cell
        removes how many.
    """
    if cell.box is not None and not all(np.array(cell.box.low) < np.array(cell.box.high)):
        raise BadInput("workspace box", "has a lower corner that is not below its upper corner")
    low, high = planned_range(robot)
    kept: list[Float[Array, "pose joint"]] = []
    tally = _Tally()
    while tally.kept < count:
        batch = min(4 * count, _BATCH)
        q = rng.uniform(low, high, size=(batch, robot.n_joints))
        kept.append(q[tally.count(judge(robot, cell, q))])
        if tally.drawn >= _MOST_DRAWN * count and tally.kept < count:
            raise NoAnswer(
                f"robot '{robot.name}': of {tally.drawn} random poses within the joint limits only "
                f"{tally.kept} are allowed: {tally.in_words()}"
            )
    return np.concatenate(kept)[:count]


def planned_range(robot: Robot) -> tuple[Float[Array, "joint"], Float[Array, "joint"]]:
    """Lowest and highest reading of every joint that a plan uses [rad or m]."""
    slides = robot.geometry.prismatic
    low = np.where(slides, robot.limits[:, 0], np.maximum(robot.limits[:, 0], -WIDEST))
    high = np.where(slides, robot.limits[:, 1], np.minimum(robot.limits[:, 1], WIDEST))
    margin = _MARGIN * (high - low)
    return low + margin, high - margin
