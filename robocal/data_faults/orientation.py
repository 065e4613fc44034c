r"""Slips of the quaternion columns: order of the four, direction, Euler angles behind them.

With the base rotation known from the positions, :math:`R_i^T B^T M_i` is the tool's rotation, the
same in every row. Only the right convention makes it so. Rows without orientation show nothing.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.data_faults.slip import Fault, Slip
from robocal.formats.measurements_csv import QUATERNION
from robocal.frames import (
    nearest_rotation,
    quaternion_from_rotation,
    rotation_from_quaternion,
)
from robocal.measurements import MeasurementSet

_QUANTILE = 0.85
_MEAN_STEPS = 6

Reading = Callable[[Float[Array, "row 4"]], Float[Array, "row 4"]]


@dataclass(frozen=True)
class Quaternions:
    """Quaternions that were meant, from those of the file."""

    reading: Reading

    def __call__(self, rows: MeasurementSet) -> MeasurementSet:
        """The rows with these orientations."""
        turned = rows.has_orientation
        orientation = rows.orientation.copy()
        orientation[turned] = self.reading(orientation[turned])
        return replace(rows, orientation=orientation)


@dataclass(frozen=True)
class _Columns:
    """The four columns stand in another order; `order[k]` holds what belongs into column k."""

    order: tuple[int, int, int, int]

    def __call__(self, quaternion: Float[Array, "row 4"]) -> Float[Array, "row 4"]:
        return np.asarray(quaternion[:, self.order])


def _conjugate(quaternion: Float[Array, "row 4"]) -> Float[Array, "row 4"]:
    return np.asarray(quaternion * np.array([1.0, -1.0, -1.0, -1.0]))


@dataclass(frozen=True)
class _Euler:
    """Angles read in one order of turns (left to right) and meant in another."""

    read: str
    meant: str
    crossed: bool
    """The first and the third number exchange their turns."""

    def __call__(self, quaternion: Float[Array, "row 4"]) -> Float[Array, "row 4"]:
        R = rotation_from_quaternion(quaternion)
        angles = _angles_zyx(R) if self.read == "zyx" else -_angles_zyx(np.swapaxes(R, 1, 2))
        if self.crossed:
            angles = angles[:, ::-1]
        x, y, z = (_turns(axis, angles[:, axis]) for axis in range(3))
        meant = z @ y @ x if self.meant == "zyx" else x @ y @ z
        return quaternion_from_rotation(meant)


def _angles_zyx(R: Float[Array, "row 3 3"]) -> Float[Array, "row 3"]:
    """Angles about x, y, z of R = Rz Ry Rx, the middle one within 90 degrees [rad]."""
    return np.column_stack([
        np.arctan2(R[:, 2, 1], R[:, 2, 2]),
        np.arctan2(-R[:, 2, 0], np.hypot(R[:, 0, 0], R[:, 1, 0])),
        np.arctan2(R[:, 1, 0], R[:, 0, 0]),
    ])


def _turns(axis: int, angle: Float[Array, "row"]) -> Float[Array, "row 3 3"]:
    quaternion = np.zeros((len(angle), 4))
    quaternion[:, 0], quaternion[:, axis + 1] = np.cos(angle / 2), np.sin(angle / 2)
    return rotation_from_quaternion(quaternion)


def orientation_slips() -> tuple[Slip, ...]:
    """Every way in which the quaternion columns may be misread."""
    order = Fault.quaternion_order
    front = "qw, qx, qy, qz hold x, y, z, w: move qz to the front"
    end = "qw, qx, qy, qz hold z, w, x, y: move qw to the end"
    passive = (
        "the orientations turn the measuring frame into the target: multiply qx, qy and qz by -1"
    )
    reverse = (
        "the Euler angles behind the quaternions were read in the reverse order "
        "(roll, pitch, yaw for yaw, pitch, roll): exchange qx and qz"
    )
    return (
        _slip(order, front, _Columns((3, 0, 1, 2))),
        _slip(order, end, _Columns((1, 2, 3, 0))),
        _slip(order, passive, _conjugate),
        # In either order, angles a, b, c taken for c, b, a exchange qx and qz, and nothing else.
        _slip(Fault.angle_convention, reverse, _Columns((0, 3, 2, 1))),
        *_euler_slips(),
    )


def _euler_slips() -> Iterator[Slip]:
    for crossed in (False, True):
        for read, meant in (("zyx", "xyz"), ("xyz", "zyx")):
            sentence = (
                f"the quaternions were made from Euler angles as "
                f"{_product(read, crossed=False)}: make them from "
                f"{_product(meant, crossed=crossed)} of the same angles a, b, c"
            )
            reading = _Euler(read, meant, crossed)
            yield _slip(Fault.angle_convention, sentence, reading)


def _product(turns: str, *, crossed: bool) -> str:
    letters = dict(zip("xyz", "cba" if crossed else "abc", strict=True))
    return " ".join(f"R{axis}({letters[axis]})" for axis in turns)


def _slip(fault: Fault, sentence: str, reading: Reading) -> Slip:
    return Slip(fault, QUATERNION, sentence, Quaternions(reading))


def orientation_misfit(flange: Float[Array, "row 3 3"], measured: Float[Array, "row 4"]) -> float:
    """Angle that most rows keep to their common tool rotation [rad].

    Parameters
    ----------
    flange
        Rotations of the flange in the measuring frame.
    measured
        Quaternions of the target.
    """
    tool = np.swapaxes(flange, 1, 2) @ rotation_from_quaternion(measured)
    weight = np.ones(len(tool))
    angle = weight
    for _ in range(_MEAN_STEPS):
        mean = nearest_rotation(np.tensordot(weight, tool, 1))
        cosine = (np.einsum("mij,ij->m", tool, mean) - 1.0) / 2.0
        angle = np.arccos(np.clip(cosine, -1.0, 1.0))
        weight = 1.0 / np.maximum(angle, np.median(angle) + 1e-9)
    return float(np.quantile(angle, _QUANTILE))
