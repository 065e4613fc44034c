"""What an identification found, in SI units."""

from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.formats.bundle import RejectedRow
from robocal.frames import invert, xyz_ypr_from_frame
from robocal.identification.adequacy import Adequacy
from robocal.identification.cell_model import CellModel
from robocal.identification.priors import Choices
from robocal.identification.station_drift import StationDrift
from robocal.kinematics.model import KinematicModel


class Status(StrEnum):
    """What became of a parameter."""

    identified = "identified"
    fixed = "fixed"
    redundant = "redundant"


@dataclass(frozen=True)
class ResidualSummary:
    """Residual = measured - predicted over some rows."""

    rows: int
    position_rms: float
    """Root mean square of the distance, of the length where only lengths were measured [m]."""
    position_mean: float
    position_max: float
    orientation_rms: float | None
    """Root mean square of the rotation angle [rad]; None without orientations."""


AXES_OF_STD = {
    "base": "x, y, z along the measuring frame's axes; yaw, pitch, roll as in ypr_deg",
    "tool": "x, y, z along the flange frame's axes; yaw, pitch, roll as in ypr_deg",
}
"""In which directions the reported uncertainties of a frame are meant"""


@dataclass(frozen=True)
class Identification:
    """The identified robot and how well the data determine it.

    Parameters
    ----------
    nominal
        Geometry before, base and tool ignored.
    cell
        Identified cell; `base` and `tool` of its robot are zero, the identified frames stand in
        `station` and `flange`.
    fitted
        The same as the fit left it, the robot's frames small moves away from where the fit began.
    free
        Indices of the parameters that moved: the identified ones and those that only their prior
        holds.
    covariance
        Of the free parameters of `fitted`, prior included, in the units of the vector
        [m, rad].
    reasons
        Why a parameter is redundant, by name.
    combinations
        What of others is identified together with a redundant one; see `Redundancy`.
    choices
        What was asked of single parameters, less the wishes to be free that could not be met.
    unmet
        Parameters asked to be free or given an own prior that the rows do not identify, and why.
    """

    nominal: KinematicModel
    cell: CellModel
    fitted: CellModel
    free: Int[Array, "free"]
    covariance: Float[Array, "free free"]
    reasons: dict[str, str]
    combinations: dict[str, dict[str, float]]
    choices: Choices
    unmet: dict[str, str]
    rank: int
    condition: float
    strategy: str
    iterations: int
    converged: bool
    adequacy: Adequacy
    fit: ResidualSummary
    held_out: ResidualSummary | None
    before: ResidualSummary
    """Nominal geometry with fitted frames, over the held-out rows (else the fit rows)."""
    rejected: tuple[RejectedRow, ...]
    suspect: tuple[RejectedRow, ...]
    """Held-out rows that look like outliers; they are counted all the same."""
    drift: StationDrift | None
    bundle_sha256: str
    tool_known: bool
    """Whether rows of the tool itself were measured, or the campaign states it."""
    tool_rotation_known: bool
    """Whether orientations of the tool were fitted, or the campaign states it."""
    base_rotation_known: bool
    """Whether more than lengths from one anchor was fitted, or the campaign states the base."""

    @property
    def fixed(self) -> frozenset[str]:
        """Parameters that were not to move."""
        return self.choices.fixed

    @property
    def model(self) -> KinematicModel:
        """The identified robot."""
        return self.cell.geometry

    def status(self, name: str) -> Status:
        """What became of a parameter."""
        if name in self.fixed:
            return Status.fixed
        return Status.redundant if name in self.reasons else Status.identified

    @property
    def std(self) -> Float[Array, "parameter"]:
        """Standard uncertainty of every parameter, zero where it did not move."""
        std = np.zeros(len(self.cell.names))
        std[self.free] = np.sqrt(np.diag(self.covariance))
        return std

    def full_covariance(self) -> Float[Array, "parameter parameter"]:
        """Covariance of the robot's parameters, zero where they did not move.

        That of base and tool is in small shifts and turns along the axes of these frames.
        """
        return self._at_origin()[0]

    def nest_covariance(self) -> Float[Array, "coordinate everything"]:
        """Of the nests' coordinates with the robot's parameters, then with each other."""
        return self._at_origin()[2]

    def _at_origin(self) -> tuple[Array, Array, Array]:
        n = len(self.cell.names)
        full = np.zeros((n, n))
        full[np.ix_(self.free, self.free)] = self.covariance
        return self.fitted.covariances_at_origin(full)

    @property
    def base(self) -> Float[Array, "4 4"]:
        """Robot base in the measuring frame."""
        return self.model.base_frame

    @property
    def tool(self) -> Float[Array, "4 4"]:
        """Target in the robot's flange frame."""
        return self._tool_of(self.model)

    def _tool_of(self, model: KinematicModel) -> Float[Array, "4 4"]:
        return np.asarray(invert(self.nominal.flange) @ model.tool_frame)

    def frame_std(self, which: str) -> Float[Array, "6"]:
        """Standard uncertainty of x, y, z, yaw, pitch, roll of `base` or `tool` as reported.

        These are the coordinates of the frame in its parent: the base in the measuring frame, the
        tool in the flange frame.
        """
        first = self._first_of(which)
        own = self.full_covariance()[first : first + 6, first : first + 6]
        J = self._reported_from_own(which)
        return np.asarray(np.sqrt(np.clip(np.diag(J @ own @ J.T), 0.0, None)))

    @cached_property
    def reported_from_own(self) -> Float[Array, "parameter parameter"]:
        """Takes small moves of the parameters to those that are reported.

        The fit moves base and tool along their own axes; reported are their coordinates in the
        parent frame. All other parameters are what they are.
        """
        whole = np.eye(len(self.cell.names))
        for which in ("base", "tool"):
            first = self._first_of(which)
            whole[first : first + 6, first : first + 6] = self._reported_from_own(which)
        return whole

    def _first_of(self, which: str) -> int:
        return self.model.n_parameters - (12 if which == "base" else 6)

    def _reported_from_own(self, which: str) -> Float[Array, "6 6"]:
        """By central differences."""
        first, step = self._first_of(which), 1e-6

        def outside(move: Float[Array, "6"]) -> Float[Array, "6"]:
            vector = self.model.vector
            vector[first : first + 6] += move
            moved = self.model.with_vector(vector)
            return xyz_ypr_from_frame(moved.base_frame if which == "base" else self._tool_of(moved))

        columns = []
        for axis in np.eye(6) * step:
            change = outside(axis) - outside(-axis)
            change[3:] = (change[3:] + np.pi) % (2 * np.pi) - np.pi
            columns.append(change / (2 * step))
        return np.column_stack(columns)
