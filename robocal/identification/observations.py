"""Measured rows as a fit needs them: arrays of columns, and weights instead of deviations."""

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.frames import rotation_from_quaternion
from robocal.identification.kept_jacobian import KeptJacobian
from robocal.instrument import InstrumentNoise
from robocal.measurements import MeasurementSet

REPRESENTATIVES = 400
"""About so many rows show what the parameters do"""
_LEAST_OF_A_KIND = 30
_LEVELS_OF_A_JOINT = 10


@dataclass(frozen=True)
class Observations:
    """Rows of any mixture of full poses, positions and lengths; weight zero means not measured.

    `axes` holds x, y, z of the measured target as (3, 3, row): component, axis, row.
    """

    joints: Float[Array, "row joint"]
    position: Float[Array, "3 row"]
    axes: Float[Array, "3 3 row"]
    distance: Float[Array, "row"]
    place: Int[Array, "row"]
    """Number of the nest, -1 for the tool."""
    position_weight: Float[Array, "row"]
    orientation_weight: Float[Array, "row"]
    distance_weight: Float[Array, "row"]

    def __len__(self) -> int:
        return len(self.joints)

    @property
    def n_scalars(self) -> int:
        """Number of measured scalars: three a position, three an orientation, one a length."""
        return int(self.scalars_of_row.sum())

    @property
    def scalars_of_row(self) -> Int[Array, "row"]:
        """Number of measured scalars of each row."""
        vectors = (self.position_weight > 0).astype(int) + (self.orientation_weight > 0)
        return np.asarray(3 * vectors + (self.distance_weight > 0))

    @cached_property
    def has_position(self) -> bool:
        """Whether any row counts its position."""
        return bool(self.position_weight.any())

    @cached_property
    def has_orientation(self) -> bool:
        """Whether any row counts its orientation."""
        return bool(self.orientation_weight.any())

    @cached_property
    def has_distance(self) -> bool:
        """Whether any row counts its length."""
        return bool(self.distance_weight.any())

    @cached_property
    def by_place(self) -> tuple[tuple[int, Int[Array, "some"], "Observations"], ...]:
        """The rows of each place with their indices; one group where all rows share a place."""
        places = np.unique(self.place)
        if len(places) == 1:
            return ((int(places[0]), np.arange(len(self)), self),)
        groups = []
        for place in places:
            index = np.flatnonzero(self.place == place)
            groups.append((int(place), index, self.choose(self.place == place)))
        return tuple(groups)

    @cached_property
    def jacobian(self) -> KeptJacobian:
        """Derivatives of the target at these rows."""
        return KeptJacobian(self.joints)

    def choose(self, rows: Bool[Array, "row"] | Int[Array, "chosen"]) -> "Observations":
        """The rows where `rows` is True, or of these numbers."""
        chosen = {
            field.name: getattr(self, field.name)[..., rows]
            for field in fields(self)
            if field.name != "joints"
        }
        return replace(self, joints=self.joints[rows], **chosen)

    @cached_property
    def representative(self) -> "Observations":
        """Some rows that stand for all, weighted for those that they stand for; all of few.

        Evenly spread over the rows of each place and of each kind of measurement, and over the
        range of each joint: what only few rows can tell is not lost.
        """
        if len(self) <= REPRESENTATIVES:
            return self
        kinds = (self.position_weight > 0) + 2 * (self.orientation_weight > 0)
        kinds = kinds + 4 * (self.distance_weight > 0)
        _, kind, counts = np.unique(8 * self.place + kinds, return_inverse=True, return_counts=True)
        chosen: Bool[Array, "row"] = np.zeros(len(self), dtype=bool)
        for number, count in enumerate(counts):
            wanted = max(_LEAST_OF_A_KIND, REPRESENTATIVES * count // len(self))
            here = np.flatnonzero(kind == number)
            chosen[here[np.linspace(0, count - 1, min(wanted, count)).astype(int)]] = True
        for reading in self.joints.T:
            order = np.argsort(reading)
            levels = np.linspace(reading[order[0]], reading[order[-1]], _LEVELS_OF_A_JOINT)
            chosen[order[np.searchsorted(reading[order], levels).clip(max=len(self) - 1)]] = True
        stands_for = np.sqrt(counts / np.bincount(kind[chosen]))[kind[chosen]]
        few = self.choose(chosen)
        return replace(
            few,
            position_weight=few.position_weight * stands_for,
            orientation_weight=few.orientation_weight * stands_for,
            distance_weight=few.distance_weight * stands_for,
        )

    def orientation_only(self) -> "Observations":
        """The orientation alone."""
        nothing = np.zeros(len(self))
        return replace(self, position_weight=nothing, distance_weight=nothing)


def observations(
    rows: MeasurementSet, noise: InstrumentNoise, place_names: tuple[str, ...] = ()
) -> Observations:
    """Rows weighted by the instrument.

    Parameters
    ----------
    rows
        Measured rows; none of a fixed nest.
    noise
        Standard uncertainty of a reading. A length is read like one coordinate.
    place_names
        Names of the nests on the tool, in the order of `CellModel.places`.
    """
    turned = rows.has_orientation
    axes = np.zeros((3, 3, len(rows)))
    if turned.any():
        rotations = rotation_from_quaternion(rows.orientation[turned])
        axes[:, :, turned] = np.moveaxis(rotations, 0, 2)
    located = np.isfinite(rows.position[:, 0])
    position = np.where(located[:, None], rows.position, 0.0)
    measured_length = np.isfinite(rows.distance)
    distance = np.where(measured_length, rows.distance, 0.0)
    orientation_std = noise.orientation_std()
    return Observations(
        joints=rows.joints,
        position=np.ascontiguousarray(position.T),
        axes=axes,
        distance=distance,
        place=np.array([place_names.index(name) if name else -1 for name in rows.target]),
        position_weight=np.where(located, 1.0 / noise.position_std(position), 0.0),
        orientation_weight=np.where(turned, 1.0 / orientation_std, 0.0),
        distance_weight=np.where(measured_length, 1.0 / noise.distance_std(distance), 0.0),
    )


def position_rows(
    joints: Float[Array, "row joint"], position: Float[Array, "row 3"], std: float
) -> Observations:
    """Rows of tool positions alone, all with the same standard deviation [m]."""
    n = len(joints)
    return Observations(
        joints=joints,
        position=np.ascontiguousarray(position.T),
        axes=np.zeros((3, 3, n)),
        distance=np.zeros(n),
        place=np.full(n, -1),
        position_weight=np.full(n, 1.0 / std),
        orientation_weight=np.zeros(n),
        distance_weight=np.zeros(n),
    )
