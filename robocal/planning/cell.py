"""What bounds the poses of a plan: its surroundings, and the instrument that sees it."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.instrument import InstrumentNoise
from robocal.kinematics.model import KinematicModel
from robocal.robots.robot import Robot

TARGET_POINT = (0.05, 0.03, 0.1)
"""Where the target is thought to be on the flange while planning; off the last axis, so that every
parameter shows [m]"""
RADIUS_SHARE = 0.05
"""Radius of the capsules round the links as a share of the arm's length, unless stated; [1]"""

PLANNED_NOISE = InstrumentNoise(15e-6, 6e-6)
"""Laser tracker of document 002 (0.015 mm + 6 ppm), where the cell does not state its own"""

Point = tuple[float, float, float]


@dataclass(frozen=True)
class Box:
    """Where the target may be, along the axes of the robot base."""

    low: Point
    """[m]"""
    high: Point
    """[m]"""


@dataclass(frozen=True)
class Station:
    """The tracker beside the robot."""

    position: Point
    """In the robot base [m]."""
    nearest: float = 0.0
    """Shortest range at which the target is measured [m]."""
    farthest: float = np.inf
    """Longest range [m]."""
    facing: Point = (0.0, 0.0, 1.0)
    """Direction in the target frame in which the target looks."""
    acceptance: float = np.pi
    """Largest angle between that direction and the line to the tracker [rad]."""


@dataclass(frozen=True)
class Cell:
    """Bounds of the poses, all in the robot base frame."""

    target: Point = TARGET_POINT
    """In the flange frame [m]."""
    box: Box | None = None
    floor: float | None = 0.0
    """Height that no part beyond the second joint goes below; None: no floor [m]."""
    link_radius: float | None = None
    """Of the capsules that stand for the links; None: `RADIUS_SHARE` of the arm's length [m]."""
    station: Station | None = None
    noise: InstrumentNoise = PLANNED_NOISE
    """Of one reading, what the robot does not repeat included."""
    sees_orientation: bool = False
    workspace: Box | None = None
    """Where the tool's uncertainty counts; None: wherever the target may be."""
    payloads: tuple[float, float] | None = None
    """Two masses that share the poses [kg]."""

    def model(self, robot: Robot) -> KinematicModel:
        """The nominal robot with its base as measuring frame and the target as tool."""
        tool = np.eye(4)
        tool[:3, 3] = self.target
        return robot.geometry.with_frames(np.eye(4), robot.geometry.flange @ tool)

    def radius(self, robot: Robot) -> float:
        """Radius of the capsules [m]."""
        return RADIUS_SHARE * arm_length(robot) if self.link_radius is None else self.link_radius

    def for_test_poses(self) -> "Cell":
        """Bounds of the poses at which the tool's uncertainty counts; no instrument sees them."""
        return replace(self, box=self.workspace or self.box, station=None)


def arm_length(robot: Robot) -> float:
    """Sum of the nominal lengths, a bound of the reach [m]."""
    links: Float[Array, "joint 5"] = robot.geometry.links
    return float(np.abs(links[:, 1:3]).sum())
