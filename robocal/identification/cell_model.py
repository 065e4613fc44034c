"""The model that a fit moves: the robot, the nests on its tool, the anchor of lengths."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.kinematics.model import KinematicModel, parameter_is_angle, parameter_names

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class CellModel:
    """Robot with frames, places of the nests, anchor.

    Parameters
    ----------
    geometry
        Robot; its own target (the tool) is where unnamed rows are measured.
    flange
        The robot's constant frame after its last link, in which the nests stand.
    place_names, places
        Nests on the tool [m].
    anchor
        Point from which lengths are measured, in the measuring frame [m]; None without lengths.
    """

    geometry: KinematicModel
    flange: Float[Array, "4 4"] = field(default_factory=lambda: np.eye(4))
    place_names: tuple[str, ...] = ()
    places: Float[Array, "place 3"] = field(default_factory=lambda: np.zeros((0, 3)))
    anchor: Float[Array, "3"] | None = None

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all parameters, in the order of `vector`."""
        if not self.place_names and self.anchor is None:
            return parameter_names(self.geometry.n_joints)
        places = [f"target_{name}_{axis}" for name in self.place_names for axis in AXES]
        anchor = [] if self.anchor is None else [f"anchor_{axis}" for axis in AXES]
        return (*parameter_names(self.geometry.n_joints), *places, *anchor)

    @property
    def targets(self) -> dict[str, Float[Array, "3"]]:
        """Places of the nests by name, in the flange frame [m]."""
        return dict(zip(self.place_names, self.places, strict=True))

    @property
    def is_angle(self) -> Bool[Array, "parameter"]:
        """True for parameters in [rad], False for those in [m]."""
        more = len(self.names) - self.geometry.n_parameters
        return np.concatenate([
            parameter_is_angle(self.geometry.n_joints),
            np.zeros(more, dtype=bool),
        ])

    @property
    def vector(self) -> Float[Array, "parameter"]:
        """All parameters [m, rad]."""
        anchor = np.zeros(0) if self.anchor is None else self.anchor
        return np.concatenate([self.geometry.vector, self.places.ravel(), anchor])

    def with_vector(self, vector: Float[Array, "parameter"]) -> "CellModel":
        """The same cell with other parameters."""
        first = self.geometry.n_parameters
        last = first + self.places.size
        return replace(
            self,
            geometry=self.geometry.with_vector(vector[:first]),
            places=vector[first:last].reshape(-1, 3),
            anchor=None if self.anchor is None else vector[last:],
        )

    def at_place(self, place: int) -> KinematicModel:
        """The robot with its target at a nest; at the tool for place -1."""
        if place < 0:
            return self.geometry
        tool = np.zeros(6)
        tool[:3] = self.places[place]
        return replace(self.geometry, flange=self.flange, tool=tool)

    def columns_at_place(self, place: int) -> tuple[Array, Array]:
        """Columns of this vector that the Jacobian of `at_place` fills, and which of its own."""
        n = self.geometry.n_parameters
        if place < 0:
            return np.arange(n), np.arange(n)
        here = n + 3 * place
        own = np.arange(n - 3)
        return np.concatenate([own[: n - 6], np.arange(here, here + 3)]), own

    def covariances_at_origin(
        self, covariance: Float[Array, "unknown unknown"]
    ) -> tuple[
        Float[Array, "robot robot"],
        Float[Array, "coefficient acting"],
        Float[Array, "coordinate everything"],
    ]:
        """What `CalibratedRobot` keeps of a covariance, for the robot with its frames as origin.

        Parameters
        ----------
        covariance
            Of everything in `vector`, then of the effects' coefficients.

        Returns
        -------
        Of the robot; of the coefficients with the robot and each other; of the nests' coordinates
        with both and each other.
        """
        whole = self.geometry.covariance_at_origin(covariance)
        n = self.geometry.n_parameters
        nests = np.arange(n, n + self.places.size)
        own = np.arange(len(self.names), len(whole))
        acting = np.concatenate([np.arange(n), own])
        everything = np.concatenate([acting, nests])
        return whole[:n, :n], whole[np.ix_(own, acting)], whole[np.ix_(nests, everything)]

    @property
    def anchor_columns(self) -> slice:
        """Columns of the anchor, the last three."""
        return slice(len(self.names) - 3, len(self.names))
