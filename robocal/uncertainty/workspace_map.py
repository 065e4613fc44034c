"""The tool's uncertainty over the workspace: many reachable poses, sorted into cubes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.frames import invert
from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import KinematicModel
from robocal.planning.candidates import draw_candidates
from robocal.robots.robot import Robot
from robocal.uncertainty.sources import Source
from robocal.uncertainty.tool_pose import tool_uncertainty

POSES = 2000
"""Reachable poses that the map is made of"""
CUBES_ACROSS = 8
"""Cubes along the longest side of the workspace"""


@dataclass(frozen=True)
class WorkspaceMap:
    """Cubes that the target reaches, in the robot's base frame; the pose's orientation varies."""

    edge: float
    """Side of a cube [m]."""
    centre: Float[Array, "cube 3"]
    """[m]"""
    poses: Int[Array, "cube"]
    """How many poses fell into it."""
    mean: Float[Array, "cube"]
    """Mean of the 95 % radius over these [m]."""
    largest: Float[Array, "cube"]
    """[m]"""


def map_workspace(
    robot: Robot,
    model: KinematicModel,
    sources: tuple[Source, ...],
    seed: int,
    count: int = POSES,
) -> WorkspaceMap:
    """Radius that holds the true tool position with 95 %, cube by cube.

    Parameters
    ----------
    robot
        Nominal robot, for its joint ranges.
    model, sources
        Identified robot and what makes it uncertain.
    seed, count
        Of the random poses.

    Raises
    ------
    NoAnswer
        If hardly any pose is admissible.
    """
    q = draw_candidates(robot, count, np.random.default_rng(seed))
    in_base = invert(model.base_frame) @ forward_kinematics(model, q)
    place = in_base[:, :3, 3]
    radius = tool_uncertainty(model, sources, q).radius
    low, high = place.min(axis=0), place.max(axis=0)
    edge = float((high - low).max()) / CUBES_ACROSS
    cell = np.minimum(((place - low) / edge).astype(int), CUBES_ACROSS - 1)
    cubes, number = np.unique(cell, axis=0, return_inverse=True)
    number = number.ravel()
    poses = np.bincount(number)
    largest = np.zeros(len(cubes))
    np.maximum.at(largest, number, radius)
    return WorkspaceMap(
        edge, low + (cubes + 0.5) * edge, poses, np.bincount(number, radius) / poses, largest
    )
