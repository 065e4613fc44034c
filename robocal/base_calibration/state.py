"""The unknowns of a registration: where the stage stood, where the slave stands, corrections."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.corrections import N_CORRECTIONS
from robocal.frames import nearest_rotation, rotation_from_quaternion


@dataclass(frozen=True)
class State:
    """All unknowns at one value.

    Small moves are counted stage by stage, then slave, then corrections; a frame's move is the
    shift of its origin [m] and then the rotation vector [rad] of a turn about it, along the
    master's axes.
    """

    stages: Float[Array, "placement 4 4"]
    """Stage frames in the master's base, one a placement."""
    slave: Float[Array, "4 4"]
    """The slave's base in the master's base."""
    corrections: Float[Array, "correction"]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return 6 * len(self.stages) + 6 + N_CORRECTIONS

    @property
    def slave_columns(self) -> slice:
        """Where the slave's six stand among the unknowns."""
        first = 6 * len(self.stages)
        return slice(first, first + 6)

    def moved(self, step: Float[Array, "unknown"]) -> "State":
        """The state after a small move of all unknowns."""
        n = len(self.stages)
        moves = step[: 6 * n + 6].reshape(n + 1, 6)
        frames = moved_frames(np.concatenate([self.stages, self.slave[None]]), moves)
        return State(frames[:n], frames[n], self.corrections + step[6 * n + 6 :])


def moved_frames(
    frames: Float[Array, "frame 4 4"], moves: Float[Array, "frame 6"]
) -> Float[Array, "frame 4 4"]:
    """Frames after a shift of their origins and a turn about them, along the outer axes."""
    moved = frames.copy()
    moved[:, :3, 3] += moves[:, :3]
    moved[:, :3, :3] = rotations_from_vectors(moves[:, 3:]) @ frames[:, :3, :3]
    return moved


def rotations_from_vectors(vectors: Float[Array, "turn 3"]) -> Float[Array, "turn 3 3"]:
    """Rotation matrices of rotation vectors [rad]."""
    half = 0.5 * np.linalg.norm(vectors, axis=1, keepdims=True)
    # sinc keeps the axis of a turn by nothing finite.
    return rotation_from_quaternion(
        np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * vectors], axis=1)
    )


def frame_of(R: Float[Array, "3 3"], p: Float[Array, "3"]) -> Float[Array, "4 4"]:
    """A homogeneous transform; the rotation is made proper to the last digit."""
    T = np.eye(4)
    T[:3, :3] = nearest_rotation(R)
    T[:3, 3] = p
    return T
