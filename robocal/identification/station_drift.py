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
    motions = [_Visit.of(first, _mean_places(rows, visit), centre, noise) for visit in visits]
    moved = sum(visit.chi_square(np.zeros(3)) for visit in motions)
    turned = sum(visit.chi_square(visit.shift) for visit in motions)
    nu = 3 * sum(len(visit.arms) for visit in motions[1:])
    nu_turned = nu - 3 * sum(len(visit.arms) > 0 for visit in motions[1:])
    with_turns = _chance(turned, nu_turned) < SIGNIFICANT
    translation, rotation = np.zeros((len(visits), 3)), np.zeros((len(visits), 3))
    for number, visit in enumerate(motions[1:], start=1):
        if not len(visit.arms):
            translation[number], rotation[number] = translation[number - 1], rotation[number - 1]
        else:
            translation[number], rotation[number] = visit.motion(with_turns=with_turns)
    times = np.array([clock[visit].mean() for visit in visits])
    return StationDrift(times, translation, rotation, centre, _chance(moved, nu))


def _chance(chi_square: float, nu: int) -> float:
    """Probability of at least this chi-square."""
    return float(gammaincc(nu / 2.0, chi_square / 2.0)) if nu > 0 else 1.0


@dataclass(frozen=True)
class _Visit:
    """What one visit of the nests says against the first."""

    arms: Float[Array, "nest 3"]
    """From the nests' centre [m]."""
    moved: Float[Array, "nest 3"]
    """Since the first visit [m]."""
    std: Float[Array, "nest"]
    """Of each coordinate of `moved`, both visits together [m]."""

    @classmethod
    def of(
        cls,
        first: dict[str, Float[Array, "3"]],
        now: dict[str, Float[Array, "3"]],
        centre: Float[Array, "3"],
        noise: InstrumentNoise,
    ) -> "_Visit":
        common = [name for name in now if name in first]
        before = np.array([first[name] for name in common]).reshape(-1, 3)
        after = np.array([now[name] for name in common]).reshape(-1, 3)
        std = np.sqrt(2.0) * noise.position_std(before)
        return cls(before - centre, after - before, std)

    @property
    def shift(self) -> Float[Array, "3"]:
        """Mean motion of the nests [m]."""
        return np.asarray(self.moved.mean(axis=0)) if len(self.moved) else np.zeros(3)

    def chi_square(self, shift: Float[Array, "3"]) -> float:
        """Sum of squares of what a shift leaves, in standard deviations."""
        return float((((self.moved - shift) / self.std[:, None]) ** 2).sum())

    def motion(self, *, with_turns: bool) -> tuple[Float[Array, "3"], Float[Array, "3"]]:
        """Translation [m] and rotation vector [rad] that move the nests so.

        A turn is only taken out where the nests show one: at the tool it acts with the whole arm
        from the nests, and its noise too.
        """
        spread = np.linalg.svd(self.arms - self.arms.mean(axis=0), compute_uv=False)
        if not with_turns or len(self.arms) < 3 or spread[1] < _LEVER:
            return self.shift, np.zeros(3)
        shifts = np.broadcast_to(np.eye(3), (len(self.arms), 3, 3))
        columns = np.concatenate([shifts, -_skew(self.arms)], axis=2).reshape(-1, 6)
        solved = np.linalg.lstsq(columns, self.moved.ravel(), rcond=None)[0]
        return solved[:3], solved[3:]


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


def _skew(vectors: Float[Array, "row 3"]) -> Float[Array, "row 3 3"]:
    """Matrices [v]x with [v]x u = v x u."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
