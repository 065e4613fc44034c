"""Random poses that a robot on a floor may take: in range, above the floor, off its base."""

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.errors import NoAnswer
from robocal.kinematics.forward import walk
from robocal.kinematics.model import KinematicModel
from robocal.robots.robot import Robot

WIDEST = np.pi
"""Joints that turn further than this either way are planned within it: cables [rad]"""
_MARGIN = 0.02
"""Share of each joint's range kept free at both ends; [1]"""
_FLOOR = 0.1
"""Lowest height of any joint beyond the second, above the base [m]"""
_COLUMN = 0.15
"""Radius round axis 1, as a share of the reach, that the wrist keeps out of; [1]"""


def draw_candidates(
    robot: Robot, count: int, rng: np.random.Generator
) -> Float[Array, "pose joint"]:
    """So many admissible joint readings, uniform in the joint ranges.

    Raises
    ------
    NoAnswer
        If fewer than one random pose in a thousand is admissible.
    """
    low = np.where(
        robot.geometry.prismatic, robot.limits[:, 0], np.maximum(robot.limits[:, 0], -WIDEST)
    )
    high = np.where(
        robot.geometry.prismatic, robot.limits[:, 1], np.minimum(robot.limits[:, 1], WIDEST)
    )
    margin = _MARGIN * (high - low)
    kept: list[Float[Array, "pose joint"]] = []
    found, drawn = 0, 0
    while found < count:
        q = rng.uniform(low + margin, high - margin, size=(4 * count, robot.n_joints))
        q = q[admissible(robot.geometry, q)]
        kept.append(q)
        found += len(q)
        drawn += 4 * count
        if drawn > 1000 * count and found < count:
            raise NoAnswer(
                f"robot '{robot.name}': only {found} of {drawn} random poses are above the floor "
                "and off the base; check its joint limits"
            )
    return np.concatenate(kept)[:count]


def admissible(model: KinematicModel, q: Float[Array, "pose joint"]) -> Bool[Array, "pose"]:
    """Poses whose joints and flange stay above the floor and whose wrist keeps off axis 1."""
    last, joints = walk(model, q)
    points = [joint.after for joint in joints[1:]] + [last.p]
    heights = np.stack([point[2] for point in points if point.shape[1] == len(q)])
    radius = np.hypot(last.p[0], last.p[1])
    reach = float(np.abs(model.links[:, 1:3]).sum())
    return np.asarray((heights > _FLOOR).all(axis=0) & (radius > _COLUMN * reach))
