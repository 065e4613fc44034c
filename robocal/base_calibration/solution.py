"""Gauss-Newton on the registration's equations, with the directions that stay open told apart."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.base_calibration.equations import Equations, build_equations, free_unknowns
from robocal.base_calibration.stage import Stage
from robocal.base_calibration.start import closed_form_start
from robocal.base_calibration.state import State
from robocal.base_calibration.touches import Touches
from robocal.errors import NoAnswer

_OPEN = 1e-5
"""A direction with less than this share of the strongest singular value (columns scaled to length
one) is open; exact ones leave 1e-13, those that only a rod's sag of micrometres tells 1e-6, the
weakest real dependence that was met 1e-4; [1]"""
_MAX_ITERATIONS = 60
_DONE = 1e-7
"""Stop when every unknown moves by less than this share of its standard deviation; [1]"""


@dataclass(frozen=True)
class Solution:
    """Where the iteration ended."""

    state: State
    equations: Equations
    """At `state`; columns of fixed corrections are kept."""
    inverse: Float[Array, "unknown row"]
    """Least-squares inverse of J of the free unknowns, zero rows for the others."""
    null: Float[Array, "unknown open"]
    """Orthonormal basis of the moves that change no residual."""
    rank: int
    """Number of directions that the equations determine."""
    iterations: int

    @property
    def covariance(self) -> Float[Array, "unknown unknown"]:
        """Of the determined part (GUM, law of propagation); open directions count as known."""
        return np.asarray(self.inverse @ self.inverse.T)

    @property
    def chi_square(self) -> float:
        """Weighted sum of squares, priors and levels included."""
        return float(self.equations.residual @ self.equations.residual)

    @property
    def nu(self) -> int:
        """Statistical degrees of freedom."""
        return len(self.equations.residual) - self.rank


def solve(touches: Touches, stage: Stage, start: State | None = None) -> Solution:
    """Weighted least squares over both robots' touches and all readings.

    Parameters
    ----------
    touches, stage
        What was measured, and how well the sensors and levels are known.
    start
        Where to begin; the closed-form start where None.

    Raises
    ------
    NoAnswer
        If the touches are too few, or the iteration does not settle (gross errors).
    """
    state = closed_form_start(touches) if start is None else start
    for iteration in range(1, _MAX_ITERATIONS + 1):
        equations = build_equations(state, touches, stage)
        free = free_unknowns(state, stage)
        inverse, null = least_squares_inverse(equations.J, free)
        step = -inverse @ equations.residual
        std = np.linalg.norm(inverse, axis=1)
        if np.all(np.abs(step) <= _DONE * std):
            rank = int(free.sum()) - null.shape[1]
            return Solution(state, equations, inverse, null, rank, iteration)
        state = state.moved(step)
    raise NoAnswer(
        f"the registration did not settle in {_MAX_ITERATIONS} iterations: check touches.csv for "
        "rows that belong to another cup, robot or placement"
    )


def least_squares_inverse(
    J: Float[Array, "row unknown"], free: Bool[Array, "unknown"]
) -> tuple[Float[Array, "unknown row"], Float[Array, "unknown open"]]:
    """Minimum-norm inverse of the free columns, and a basis of what they leave open."""
    columns = J[:, free]
    scale = np.linalg.norm(columns, axis=0)
    scale[scale == 0.0] = 1.0
    # Only fewer rows than columns need the full V for the open directions.
    U, sigma, Vt = np.linalg.svd(columns / scale, full_matrices=len(J) < len(scale))
    rank = int((sigma > _OPEN * sigma[0]).sum())
    inverse = np.zeros((J.shape[1], J.shape[0]))
    inverse[free] = (Vt[:rank].T / sigma[:rank]) @ U[:, :rank].T / scale[:, None]
    null = np.zeros((J.shape[1], len(scale) - rank))
    null[free] = Vt[rank:].T / scale[:, None]
    if null.size:
        null = np.linalg.qr(null)[0]
        inverse -= null @ (null.T @ inverse)
    return inverse, null
