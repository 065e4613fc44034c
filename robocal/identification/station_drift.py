r"""Drift of the measuring station, from nests that stand fixed beside the robot.

Each visit of the nests gives the motion of the station's frame since the first visit: a
translation, and a rotation too where three or more nests that are not in line were seen. Over time
it is smoothed as far as the nests' noise allows, and interpolated between visits. Rows are carried
back into the frame of the first visit.
"""

from collections import Counter
from collections.abc import Collection
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
_HIGHEST_DEGREE = 3
_SMOOTH_ENOUGH = 0.05
"""Chance of noise to leave as much as the polynomial leaves; [1]"""
_LEVER = 0.05
"""Nests closer to a line than this give no rotation [m]"""
_SEEN_ONCE = "a fixed nest of one visit alone shows no drift; visit it again, best at the end"


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
    factor: Float[Array, "visit 6 noise"]
    """How translation and rotation are off for a unit of each independent noise of the nests."""
    timed: bool
    """Whether `time` is in seconds."""

    def clock(self, rows: MeasurementSet) -> Float[Array, "row"]:
        """Time of each row as `time` counts it."""
        return rows.time if self.timed else rows.lines.astype(float)

    @property
    def significant(self) -> bool:
        """Whether the drift is more than noise, and is therefore removed."""
        return self.p_value < SIGNIFICANT

    @property
    def largest(self) -> float:
        """Largest translation since the first visit [m]."""
        return float(np.linalg.norm(self.translation, axis=1).max())


def seen_once(rows: MeasurementSet, fixed: Collection[str]) -> dict[int, str]:
    """Line and reason of the rows of those fixed nests that were visited a single time."""
    names = np.array(rows.target)
    visits = [set(names[visit].tolist()) for visit in _visits(np.isin(names, list(fixed)))]
    times = Counter(name for seen in visits for name in seen)
    once = np.isin(names, [name for name, count in times.items() if count == 1])
    return dict.fromkeys(rows.lines[once].tolist(), _SEEN_ONCE)


def find_drift(
    rows: MeasurementSet, fixed: Bool[Array, "row"], noise: InstrumentNoise
) -> StationDrift | None:
    """Motion of the station from the rows of fixed nests; None with fewer than two visits."""
    clock = _clock(rows)
    visits = _visits(fixed)
    if len(visits) < 2:
        return None
    places = [_mean_places(rows, visit) for visit in visits]
    names = sorted({name for seen in places for name in seen})
    nothing = np.full(3, np.nan)
    seen = np.array([[visit.get(name, nothing) for name in names] for visit in places])
    mean = np.nanmean(seen, axis=0)
    std = noise.position_std(mean)[:, None]
    away = seen - mean
    count = int(np.isfinite(away[:, :, 0]).sum())
    still = _chance(float(np.nansum((away / std) ** 2)), 3 * (count - len(names)))
    shift = np.nanmean(away, axis=1)
    left = float(np.nansum(((away - shift[:, None]) / std) ** 2))
    turning = _chance(left, 3 * (count - len(names) - len(visits) + 1)) < SIGNIFICANT
    arms = mean - mean.mean(axis=0)
    gains = [_gain(arms, moved, with_turns=turning) for moved in away]
    motion = np.array([
        gain @ np.nan_to_num(moved).ravel() for gain, moved in zip(gains, away, strict=True)
    ])
    times = np.array([clock[visit].mean() for visit in visits])
    smoother = _smoother(times, motion, float(np.sqrt(np.mean(std**2) / len(names))))
    smoother -= smoother[0].copy()
    smooth = smoother @ motion
    noisy = np.stack(gains) * np.repeat(std.ravel(), 3)
    factor = np.einsum("vu,upk->vpuk", smoother, noisy).reshape(len(times), 6, -1)
    return StationDrift(
        times, smooth[:, :3], smooth[:, 3:], mean.mean(axis=0), still, factor, _timed(rows)
    )


def _chance(chi_square: float, nu: int) -> float:
    """Probability of at least this chi-square."""
    return float(gammaincc(nu / 2.0, chi_square / 2.0)) if nu > 0 else 1.0


def _gain(
    arms: Float[Array, "nest 3"], moved: Float[Array, "nest 3"], *, with_turns: bool
) -> Float[Array, "6 scalar"]:
    """What takes the nests' moves to the translation [m] and rotation vector [rad] of one visit.

    A turn is only taken out where the nests show one: at the tool it acts with the whole arm from
    the nests, and its noise too.
    """
    there = np.isfinite(moved[:, 0])
    gain = np.zeros((6, len(moved), 3))
    spread = np.linalg.svd(arms[there] - arms[there].mean(axis=0), compute_uv=False)
    if not with_turns or there.sum() < 3 or spread[1] < _LEVER:
        gain[:3, there] = np.eye(3)[:, None] / there.sum()
    else:
        shifts = np.broadcast_to(np.eye(3), (int(there.sum()), 3, 3))
        columns = np.concatenate([shifts, -_skew(arms[there])], axis=2).reshape(-1, 6)
        gain[:, there] = np.linalg.pinv(columns).reshape(6, -1, 3)
    return gain.reshape(6, -1)


def _smoother(
    times: Float[Array, "visit"], motion: Float[Array, "visit 6"], std: float
) -> Float[Array, "visit visit"]:
    """To the plainest polynomial in time that leaves no more than the nests' noise, else nothing.

    Visit by visit the nests' own noise would be written into every row.
    """
    scaled = (times - times.mean()) / max(float(np.ptp(times)), 1e-12)
    for degree in range(1, _HIGHEST_DEGREE + 1):
        nu = 3 * (len(times) - degree - 1)
        if nu <= 0:
            break
        columns = np.vander(scaled, degree + 1)
        onto = np.asarray(columns @ np.linalg.pinv(columns))
        left = float((((motion - onto @ motion)[:, :3] / std) ** 2).sum())
        if _chance(left, nu) > _SMOOTH_ENOUGH:
            return onto
    return np.eye(len(times))


def remove_drift(rows: MeasurementSet, drift: StationDrift) -> MeasurementSet:
    """The rows as the station of the first visit would have seen them."""
    clock = drift.clock(rows)
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
    return rows.time if _timed(rows) else rows.lines.astype(float)


def _timed(rows: MeasurementSet) -> bool:
    return bool(np.isfinite(rows.time).all())


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
