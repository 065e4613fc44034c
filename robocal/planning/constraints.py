"""Which bound of the cell each pose keeps. One function a bound; `CONSTRAINTS` names them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.planning.capsules import ArmShape, arm_shape, is_hidden, touches_itself
from robocal.planning.cell import Cell, Station
from robocal.robots.robot import Robot

_FIRST_FREE_JOINT = 2
"""Links from here on can come near the floor; those before stand on it"""

Kept = Bool[Array, "pose"]


@dataclass(frozen=True)
class PosedArm:
    """Poses to judge."""

    cell: Cell
    shape: ArmShape
    radius: float
    """Of the capsules [m]."""


def in_box(arm: PosedArm) -> Kept | None:
    """The target is in the workspace box."""
    box = arm.cell.box
    if box is None:
        return None
    low, high = np.array(box.low)[:, None], np.array(box.high)[:, None]
    return np.asarray(((arm.shape.target >= low) & (arm.shape.target <= high)).all(axis=0))


def above_floor(arm: PosedArm) -> Kept | None:
    """The arm beyond its second joint is above the floor."""
    floor = arm.cell.floor
    if floor is None:
        return None
    heights = [
        np.minimum(segment.start[2], segment.end[2])
        for segment, joint in zip(arm.shape.segments, arm.shape.joint, strict=True)
        if joint >= _FIRST_FREE_JOINT
    ]
    return np.asarray(np.min(heights, axis=0) >= floor + arm.radius)


def off_itself(arm: PosedArm) -> Kept:
    """No two links touch."""
    return ~touches_itself(arm.shape, arm.radius)


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


CONSTRAINTS: dict[str, Callable[[PosedArm], Kept | None]] = {
    "workspace box": in_box,
    "floor": above_floor,
    "self-collision": off_itself,
    "tracker range": in_range,
    "target acceptance": facing_tracker,
    "line of sight": in_sight,
}
"""None stands for a bound that the cell does not state."""


def judge(robot: Robot, cell: Cell, q: Float[Array, "pose joint"]) -> dict[str, Kept]:
    """For each bound that the cell states, the poses that keep it."""
    floor = 0.0 if cell.floor is None else cell.floor
    arm = PosedArm(cell, arm_shape(cell.model(robot), q, floor), cell.radius(robot))
    judged = {name: constraint(arm) for name, constraint in CONSTRAINTS.items()}
    return {name: kept for name, kept in judged.items() if kept is not None}
