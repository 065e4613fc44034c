"""Which bound of the cell each pose keeps. One function a bound; two tables name them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.planning.capsules import ArmShape, arm_shape, is_hidden, self_clearance
from robocal.planning.cell import Cell, Station
from robocal.robots.robot import Robot

_FIRST_FREE_JOINT = 2
"""Links from here on can come near the floor; those before stand on it"""

Kept = Bool[Array, "pose"]
Clearance = Float[Array, "pose"]
"""Distance to a bound, negative beyond it [m]"""


@dataclass(frozen=True)
class PosedArm:
    """Poses to judge."""

    cell: Cell
    shape: ArmShape
    radius: float
    """Of the capsules [m]."""


def box_clearance(arm: PosedArm) -> Clearance | None:
    """How far the target is inside the workspace box."""
    box = arm.cell.box
    if box is None:
        return None
    low, high = np.array(box.low)[:, None], np.array(box.high)[:, None]
    inside = np.minimum(arm.shape.target - low, high - arm.shape.target)
    return np.asarray(inside.min(axis=0))


def floor_clearance(arm: PosedArm) -> Clearance | None:
    """How far the arm beyond its second joint is above the floor."""
    floor = arm.cell.floor
    if floor is None:
        return None
    heights = [
        np.minimum(segment.start[2], segment.end[2])
        for segment, joint in zip(arm.shape.segments, arm.shape.joint, strict=True)
        if joint >= _FIRST_FREE_JOINT
    ]
    return np.asarray(np.min(heights, axis=0) - (floor + arm.radius))


def clearance_of_itself(arm: PosedArm) -> Clearance:
    """How far the nearest two links are apart."""
    return self_clearance(arm.shape, arm.radius)


CLEARANCES: dict[str, Callable[[PosedArm], Clearance | None]] = {
    "workspace box": box_clearance,
    "floor": floor_clearance,
    "self-collision": clearance_of_itself,
}
"""Bounds of every posture, on the way as well as at a pose; None: the cell states none."""


def in_range(arm: PosedArm) -> Kept | None:
    """The tracker measures at this distance."""
    station = arm.cell.station
    if station is None:
        return None
    ranges = np.linalg.norm(_to_station(arm, station), axis=0)
    return np.asarray((ranges >= station.nearest) & (ranges <= station.farthest))


def facing_tracker(arm: PosedArm) -> Kept | None:
    """The target accepts the beam."""
    station = arm.cell.station
    if station is None:
        return None
    facing = np.array(station.facing) / np.linalg.norm(station.facing)
    looking = np.einsum("ijm,j->im", arm.shape.axes, facing)
    towards = _to_station(arm, station)
    cosine = (looking * towards).sum(axis=0) / np.linalg.norm(towards, axis=0)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)) <= station.acceptance)


def in_sight(arm: PosedArm) -> Kept | None:
    """No link stands in the beam."""
    station = arm.cell.station
    return None if station is None else ~is_hidden(arm.shape, arm.radius, station.position)


def _to_station(arm: PosedArm, station: Station) -> Float[Array, "3 pose"]:
    return np.asarray(np.array(station.position)[:, None] - arm.shape.target)


SIGHTS: dict[str, Callable[[PosedArm], Kept | None]] = {
    "tracker range": in_range,
    "target acceptance": facing_tracker,
    "line of sight": in_sight,
}
"""What a pose needs to be measured; None: the cell states no tracker."""

CONSTRAINTS = (*CLEARANCES, *SIGHTS)


def judge(robot: Robot, cell: Cell, q: Float[Array, "pose joint"]) -> dict[str, Kept]:
    """For each bound that the cell states, the poses that keep it."""
    arm = posed_arm(robot, cell, q)
    seen = {name: sight(arm) for name, sight in SIGHTS.items()}
    kept = {name: clearance >= 0.0 for name, clearance in clearances(arm).items()}
    return kept | {name: sees for name, sees in seen.items() if sees is not None}


def posed_arm(robot: Robot, cell: Cell, q: Float[Array, "pose joint"]) -> PosedArm:
    """The arm at joint readings, in its cell."""
    floor = 0.0 if cell.floor is None else cell.floor
    return PosedArm(cell, arm_shape(cell.model(robot), q, floor), cell.radius(robot))


def clearances(arm: PosedArm) -> dict[str, Clearance]:
    """How far every posture is from each bound that the cell states, negative beyond it [m]."""
    found = {name: clearance(arm) for name, clearance in CLEARANCES.items()}
    return {name: gap for name, gap in found.items() if gap is not None}
