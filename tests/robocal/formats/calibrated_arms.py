"""Calibrated robots whose true poses an independent program knows."""

from dataclasses import dataclass, replace

import numpy as np

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.frames import invert
from robocal.robots.library import load_robot
from tests.elementary_kinematics import Arm, load_arm, random_frame


@dataclass(frozen=True)
class CalibratedArm:
    """The same robot for the code under test and for the oracle."""

    calibrated: CalibratedRobot
    nominal: Arm
    true: Arm
    tool: np.ndarray
    """Behind the robot's own flange"""


def calibrated_arm(name: str, seed: int = 1) -> CalibratedArm:
    """A robot off its nominal geometry by 0.5 mm and 0.5 mrad, in frames drawn by the seed."""
    rng = np.random.default_rng(seed)
    nominal = load_arm(name)
    links = nominal.links + rng.normal(0, 5e-4, nominal.links.shape)
    base, tool = random_frame(rng, 1.5), random_frame(rng, 0.15)
    robot = load_robot(name)
    model = replace(robot.geometry, links=links, station=base, flange=robot.geometry.flange @ tool)
    n = 5 * len(links) + 12
    provenance = Provenance("0" * 64, "0", "2026-01-01", "simultaneous")
    calibrated = CalibratedRobot(robot, model, np.zeros((n, n)), np.array([0, 0, -1.0]), provenance)
    frames = (base, robot.geometry.flange @ tool)
    return CalibratedArm(
        calibrated, nominal.within(*frames), replace(nominal, links=links).within(*frames), tool
    )


def largest_difference(expected: np.ndarray, found: np.ndarray) -> float:
    """Largest error of any coordinate or axis component [m, 1]."""
    return float(np.abs(expected - found).max())


def seen_from(base: np.ndarray, T: np.ndarray) -> np.ndarray:
    """Poses in another frame."""
    return invert(base) @ T
