"""What every identification strategy is given and gives back."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.identification.cell_model import CellModel
from robocal.identification.least_squares import Minimum, Prior, levenberg_marquardt
from robocal.identification.observations import Observations
from robocal.identification.problem import NormalEquations, normal_equations


@dataclass(frozen=True)
class Problem:
    """Rows to fit, where to start, and what may move.

    Parameters
    ----------
    start
        Cell whose robot has its frames as origin (`KinematicModel.with_frames_as_origin`).
    rows
        Measured rows.
    free
        Indices of the parameters to identify.
    prior_mean
        Of every parameter [m, rad].
    prior_precision
        Inverse variance of every parameter about that mean [1/m2 or 1/rad2].
    """

    start: CellModel
    rows: Observations
    free: Int[Array, "free"]
    prior_mean: Float[Array, "parameter"]
    prior_precision: Float[Array, "parameter"]

    def fit(
        self,
        cell: CellModel,
        free: Int[Array, "some"],
        rows: Observations,
        max_iterations: int,
    ) -> Minimum:
        """Least squares over some of the parameters and some of the rows, from `cell` on."""
        vector = cell.vector

        def linearise(x: Array) -> NormalEquations:
            moved = vector.copy()
            moved[free] = x
            return normal_equations(cell.with_vector(moved), rows, free)

        prior = Prior(self.prior_mean[free], self.prior_precision[free])
        return levenberg_marquardt(linearise, vector[free], prior, max_iterations)

    def moved(self, cell: CellModel, free: Int[Array, "some"], minimum: Minimum) -> CellModel:
        """`cell` with the parameters of a minimum."""
        vector = cell.vector
        vector[free] = minimum.x
        return cell.with_vector(vector)

    @property
    def angular(self) -> Int[Array, "some"]:
        """Free parameters that turn the target: link angles and frame rotations."""
        return np.asarray(self.free[self.start.is_angle[self.free]])


@dataclass(frozen=True)
class Fit:
    """Where a strategy ended."""

    cell: CellModel
    minimum: Minimum
    iterations: int
    """Evaluations of the Jacobian, over all stages."""
    converged: bool


@runtime_checkable
class Strategy(Protocol):
    """A way to the minimum."""

    def __call__(self, problem: Problem) -> Fit:
        """Identify the free parameters of `problem`."""
        ...
