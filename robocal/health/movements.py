"""What may have moved since a calibration, each as a few numbers and their derivatives.

The sizes are what such an event usually has; they only weigh the alternatives against each other.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel

_SHIFT = 1e-3
"""Usual size of a shift of base or tool [m]"""
_TURN = 1e-3
"""Usual size of a turn of the base or of a joint's zero [rad]"""
_EXPANSION = 23e-6
"""Of aluminium [1/K]"""
_USUAL_WARMING = 10.0
"""Where nobody measured the temperature [K]"""
_LEAST_WARMING = 1.0
"""A probe on one link does not know the others better [K]"""


@dataclass(frozen=True)
class Movement:
    """One alternative.

    Parameters
    ----------
    name
        `base`, `tool`, `joint_3`, `temperature`.
    family
        Alternatives of one family share one prior probability.
    numbers
        Names of its numbers, with units.
    sizes
        Usual size of each number [m, rad, 1].
    """

    name: str
    family: str
    numbers: tuple[str, ...]
    sizes: Float[Array, "number"]


def movements(n_joints: int, warming: float | None) -> tuple[Movement, ...]:
    """All alternatives.

    Parameters
    ----------
    warming
        Temperature now less that of the calibration [K]; None if unknown.
    """
    turns = [
        Movement(f"joint_{joint + 1}", "joint", ("zero",), np.array([_TURN]))
        for joint in range(n_joints)
    ]
    degrees = _USUAL_WARMING if warming is None else max(abs(warming), _LEAST_WARMING)
    return (
        Movement(
            "base", "base", ("x", "y", "z", "yaw", "pitch", "roll"), np.repeat([_SHIFT, _TURN], 3)
        ),
        Movement("tool", "tool", ("x", "y", "z"), np.full(3, _SHIFT)),
        *turns,
        Movement("temperature", "temperature", ("growth",), np.array([_EXPANSION * degrees])),
    )


def moved(
    model: KinematicModel, movement: Movement, numbers: Float[Array, "number"]
) -> KinematicModel:
    """The robot after a movement; `model` has its frames as origin."""
    vector = model.vector
    if movement.name == "temperature":
        return replace(model, links=model.links * (1.0 + numbers[0] * _grows()))
    vector[_places(model, movement)] += numbers
    return model.with_vector(vector)


def derivatives(
    model: KinematicModel, movement: Movement, q: Float[Array, "pose joint"]
) -> Float[Array, "scalar number"]:
    """Of the target's coordinates, pose by pose, with respect to the movement's numbers."""
    _, J = pose_jacobian(model, q)
    columns = J[:, :3].transpose(2, 1, 0).reshape(3 * len(q), -1)
    if movement.name == "temperature":
        growth = (model.links * _grows()).ravel()
        return np.asarray(columns[:, : len(growth)] @ growth[:, None])
    return np.asarray(columns[:, _places(model, movement)])


def _grows() -> Float[Array, "5"]:
    """Which link parameters are lengths: d and a."""
    return np.array([0.0, 1.0, 1.0, 0.0, 0.0])


def _places(model: KinematicModel, movement: Movement) -> list[int]:
    """Where the movement's numbers stand in the parameter vector."""
    first_of_base = 5 * model.n_joints
    if movement.name == "base":
        return list(range(first_of_base, first_of_base + 6))
    if movement.name == "tool":
        return list(range(first_of_base + 6, first_of_base + 9))
    joint = int(movement.name.removeprefix("joint_")) - 1
    return [5 * joint + int(model.prismatic[joint])]
