r"""Drift of the measuring station, from nests that stand fixed beside the robot.

Each visit of the nests gives the motion of the station's frame since the first visit: a
translation, and a rotation too where three or more nests that are not in line were seen. Between
visits it is interpolated over time. Rows are carried back into the frame of the first visit.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array
from scipy.special import gammaincc

from robocal.frames import quaternion_from_rotation, rotation_from_quaternion
from robocal.instrument import InstrumentNoise
from robocal.measurements import MeasurementSet

SIGNIFICANT = 0.01
"""Chance of a still station to look as if it moved; [1]"""
_LEVER = 0.05
"""Nests closer to a line than this give no rotation [m]"""


@dataclass(frozen=True)
class StationDrift:
    """Motion of the station since the first visit, one entry a visit."""

    time: Float[Array, "visit"]
    """[s], or the row number where the file has no times."""
    translation: Float[Array, "visit 3"]
    """Of the nests' centre [m]."""
    rotation: Float[Array, "visit 3"]
    """Rotation vector about the nests' centre [rad]."""
    centre: Float[Array, "3"]
    p_value: float
    """Chance that a still station gives these readings."""

    @property
    def significant(self) -> bool:
        """Whether the drift is more than noise, and is therefore removed."""
        return self.p_value < SIGNIFICANT

    @property
    def largest(self) -> float:
        """Largest translation since the first visit [m]."""
        return float(np.linalg.norm(self.translation, axis=1).max())


def find_drift(
    rows: MeasurementSet, fixed: Bool[Array, "row"], noise: InstrumentNoise
) -> StationDrift | None:
    """Motion of the station from the rows of fixed nests; None with fewer than two visits."""
    clock = _clock(rows)
    visits = _visits(fixed)
    if len(visits) < 2:
        return None
    first = _mean_places(rows, visits[0])
    centre = np.mean(list(first.values()), axis=0)
    translation, rotation = np.zeros((len(visits), 3)), np.zeros((len(visits), 3))
    chi_square, nu = 0.0, 0
    for number, visit in enumerate(visits[1:], start=1):
        now = _mean_places(rows, visit)
        common = [name for name in now if name in first]
        if not common:
            translation[number], rotation[number] = translation[number - 1], rotation[number - 1]
            continue
        before = np.array([first[name] for name in common])
        moved = np.array([now[name] for name in common]) - before
        std = noise.position_std(before)
        chi_square += float((moved**2 / (2.0 * std[:, None] ** 2)).sum())
        nu += 3 * len(common)
        translation[number], rotation[number] = _motion(before - centre, moved)
    p_value = float(gammaincc(nu / 2.0, chi_square / 2.0)) if nu else 1.0
    times = np.array([clock[visit].mean() for visit in visits])
    return StationDrift(times, translation, rotation, centre, p_value)


def remove_drift(rows: MeasurementSet, drift: StationDrift) -> MeasurementSet:
    """The rows as the station of the first visit would have seen them."""
    clock = _clock(rows)
    shift = np.column_stack([
        np.interp(clock, drift.time, drift.translation[:, k]) for k in range(3)
    ])
    turn = np.column_stack([np.interp(clock, drift.time, drift.rotation[:, k]) for k in range(3)])
    arm = rows.position - shift - drift.centre
    position = drift.centre + arm - np.cross(turn, arm)
    orientation = rows.orientation.copy()
    turned = rows.has_orientation
    if turned.any():
        back = np.eye(3) - _skew(turn[turned])
        orientation[turned] = quaternion_from_rotation(
            back @ rotation_from_quaternion(orientation[turned])
        )
    return replace(rows, position=position, orientation=orientation)


def _clock(rows: MeasurementSet) -> Float[Array, "row"]:
    """Time of each row, its number in the file where there are no times."""
    if np.isfinite(rows.time).all():
        return rows.time
    return rows.lines.astype(float)


def _visits(fixed: Bool[Array, "row"]) -> list[Int[Array, "some"]]:
    """Runs of rows of fixed nests, unbroken by other rows."""
    index = np.flatnonzero(fixed)
    if not len(index):
        return []
    return np.split(index, np.flatnonzero(np.diff(index) > 1) + 1)


def _mean_places(rows: MeasurementSet, visit: Int[Array, "some"]) -> dict[str, Float[Array, "3"]]:
    names = {rows.target[row] for row in visit}
    return {
        name: rows.position[[row for row in visit if rows.target[row] == name]].mean(axis=0)
        for name in sorted(names)
    }


def _motion(
    arms: Float[Array, "nest 3"], moved: Float[Array, "nest 3"]
) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
    """Translation and small rotation that move the nests so."""
    spread = np.linalg.svd(arms - arms.mean(axis=0), compute_uv=False)
    if len(arms) < 3 or spread[1] < _LEVER:
        return moved.mean(axis=0), np.zeros(3)
    columns = np.concatenate([np.broadcast_to(np.eye(3), (len(arms), 3, 3)), -_skew(arms)], axis=2)
    solved = np.linalg.lstsq(columns.reshape(-1, 6), moved.ravel(), rcond=None)[0]
    return solved[:3], solved[3:]


def _skew(vectors: Float[Array, "row 3"]) -> Float[Array, "row 3 3"]:
    """Matrices [v]x with [v]x u = v x u."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
