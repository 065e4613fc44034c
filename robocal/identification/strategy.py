"""What every identification strategy is given and gives back."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.identification.least_squares import Minimum, Prior, levenberg_marquardt
from robocal.identification.problem import (
    NormalEquations,
    Observations,
    normal_equations,
)
from robocal.kinematics.model import KinematicModel


@dataclass(frozen=True)
class Problem:
    """Rows to fit, where to start, and what may move.

    Parameters
    ----------
    start
        Model with its frames as origin (`KinematicModel.with_frames_as_origin`).
    rows
        Measured rows.
    free
        Indices of the parameters to identify.
    prior_precision
        Of every parameter, about its value in `start` [1/m2 or 1/rad2].
    """

    start: KinematicModel
    rows: Observations
    free: Int[Array, "free"]
    prior_precision: Float[Array, "parameter"]

    def fit(
        self,
        model: KinematicModel,
        free: Int[Array, "some"],
        rows: Observations,
        max_iterations: int,
    ) -> Minimum:
        """Least squares over some of the parameters and some of the rows, from `model` on."""
        vector = model.vector

        def linearise(x: Float[Array, "some"]) -> NormalEquations:
            return normal_equations(model_at(x), rows, free)

        def model_at(x: Float[Array, "some"]) -> KinematicModel:
            moved = vector.copy()
            moved[free] = x
            return model.with_vector(moved)

        prior = Prior(self.start.vector[free], self.prior_precision[free])
        return levenberg_marquardt(linearise, vector[free], prior, max_iterations)

    def moved(
        self, model: KinematicModel, free: Int[Array, "some"], minimum: Minimum
    ) -> KinematicModel:
        """`model` with the parameters of a minimum."""
        vector = model.vector
        vector[free] = minimum.x
        return model.with_vector(vector)


@dataclass(frozen=True)
class Fit:
    """Where a strategy ended."""

    model: KinematicModel
    minimum: Minimum
    iterations: int
    """Evaluations of the Jacobian, over all stages."""
    converged: bool


class Strategy(Protocol):
    """A way to the minimum."""

    def __call__(self, problem: Problem) -> Fit:
        """Identify the free parameters of `problem`."""
        ...


def angular_parameters(problem: Problem) -> Int[Array, "some"]:
    """Free parameters that turn the target: link angles and frame rotations."""
    names = np.tile([True, False, False, True, True], problem.start.n_joints)
    frame = [False, False, False, True, True, True]
    angular = np.concatenate([names, frame, frame])
    return np.asarray(problem.free[angular[problem.free]])
