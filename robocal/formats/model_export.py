"""A calibrated robot as text of another program, and the proof that it reads back the same."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput, NoAnswer
from robocal.formats.whole_file import part_of, place_of
from robocal.frames import invert, rotation_vector
from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import KinematicModel

READ_BACK_POSES = 1000
_SEED = 1
_LARGEST_POSITION = 1e-9
"""The promise of issue 3 [m]"""
_LARGEST_ANGLE = 1e-9
"""[rad]"""


@dataclass(frozen=True)
class ExportOptions:
    """What a format needs beyond the model; None where the user said nothing."""

    hash: str | None = None
    """UR kinematics: the robot's own hash"""
    euler: str | None = None
    """RoboDK: order of its three angles"""


@dataclass(frozen=True)
class Difference:
    """Largest difference between what was written and what was read back."""

    poses: int
    position: float
    """[m]"""
    angle: float
    """[rad]"""


@dataclass(frozen=True)
class Export:
    """A file to write.

    Parameters
    ----------
    text
        Its content.
    left_out
        One sentence for everything that the format cannot hold.
    difference
        Reads a written file and compares it with what it should hold.
    """

    text: str
    left_out: tuple[str, ...]
    difference: Callable[[Path], Difference]


def write_export(path: Path, export: Export) -> Difference:
    """Write the file if it reads back the same, else leave nothing.

    Raises
    ------
    NoAnswer
        If the forward kinematics differ by more than 1e-9 m or 1e-9 rad.
    BadInput
        If the file cannot be written.
    """
    place = place_of(path)
    part = part_of(place)
    try:
        part.write_text(export.text, encoding="utf-8", newline="\n")
    except OSError as error:
        raise BadInput(str(path), f"cannot be written: {error.strerror}") from None
    difference = export.difference(part)
    if difference.position > _LARGEST_POSITION or difference.angle > _LARGEST_ANGLE:
        part.unlink()
        raise NoAnswer(
            f"{path.name} would differ from the model by {difference.position:.1e} m and "
            f"{difference.angle:.1e} rad; it was not written"
        )
    part.replace(place)
    return difference


def random_joints(
    limits: Float[Array, "joint 2"], count: int = READ_BACK_POSES
) -> Float[Array, "pose joint"]:
    """Joint readings spread evenly over the joint ranges [rad or m]."""
    return np.random.default_rng(_SEED).uniform(limits[:, 0], limits[:, 1], (count, len(limits)))


def model_difference(
    expected: KinematicModel, found: KinematicModel, limits: Float[Array, "joint 2"]
) -> Difference:
    """Largest difference of the forward kinematics over random poses."""
    q = random_joints(limits)
    return pose_difference(forward_kinematics(expected, q), forward_kinematics(found, q))


def pose_difference(
    expected: Float[Array, "pose 4 4"], found: Float[Array, "pose 4 4"]
) -> Difference:
    """Largest difference between two lists of poses."""
    shift = np.linalg.norm(expected[:, :3, 3] - found[:, :3, 3], axis=1)
    turn = rotation_vector((invert(expected) @ found)[:, :3, :3])
    return Difference(len(expected), float(shift.max()), float(np.linalg.norm(turn, axis=1).max()))
