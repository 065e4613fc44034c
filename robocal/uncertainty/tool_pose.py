"""Uncertainty of the tool's pose at any joint readings, by the law of propagation.

References
----------
.. [1] JCGM 102:2011, 6.2 and 6.5 (several outputs); JCGM 100:2008, G.4.1.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.kinematics.forward import blocks
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel
from robocal.uncertainty.propagation import COVERAGE
from robocal.uncertainty.sources import Source

_BLOCK = 500


@dataclass(frozen=True)
class ToolUncertainty:
    """Uncertainty of the target at each pose, in the measuring frame."""

    covariance: Float[Array, "pose 6 6"]
    """Of position [m] and rotation vector [rad]."""
    nu: Float[Array, "pose"]
    """Effective degrees of freedom of the position."""
    shares: Float[Array, "pose source"]
    """Of the position's variance (trace), in the order of the sources; [1]"""

    @property
    def position_std(self) -> Float[Array, "pose 3"]:
        """Standard uncertainty of x, y, z [m]."""
        return _roots(self.covariance)[:, :3]

    @property
    def orientation_std(self) -> Float[Array, "pose 3"]:
        """Standard uncertainty of the rotation vector's components [rad]."""
        return _roots(self.covariance)[:, 3:]

    @property
    def radius(self) -> Float[Array, "pose"]:
        """Distance from the estimate that holds the true position with `COVERAGE` [m]."""
        return coverage_radius(self.covariance[:, :3, :3], self.nu)


def tool_uncertainty(
    model: KinematicModel, sources: tuple[Source, ...], q: Float[Array, "pose joint"]
) -> ToolUncertainty:
    """Propagate all sources to the target at joint readings `q` [rad or m]."""
    n = model.n_parameters
    total = np.zeros((len(q), 6, 6))
    variances = np.zeros((len(q), len(sources)))
    for block in blocks(len(q), _BLOCK):
        _, J = pose_jacobian(model, q[block])
        by_pose = np.moveaxis(J, 2, 0)  # (pose, parameter, 6)
        for number, source in enumerate(sources):
            own = np.swapaxes(by_pose, 1, 2) @ source.covariance[:n, :n] @ by_pose
            total[block] += own
            # Frames that are open by metres cancel at the tool, to below zero by their rounding.
            variances[block, number] = np.maximum(np.einsum("mii->m", own[:, :3, :3]), 0.0)
    nu = np.array([source.nu for source in sources])
    summed = variances.sum(axis=1)
    certain = (variances**2 / nu).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        effective = np.where(certain > 0, summed**2 / certain, np.inf)
        shares = np.where(summed[:, None] > 0, variances / summed[:, None], 0.0)
    return ToolUncertainty(total, effective, shares)


def _roots(covariance: Float[Array, "pose 6 6"]) -> Float[Array, "pose 6"]:
    """Standard uncertainties; a variance below zero is the rounding of none."""
    return np.asarray(np.sqrt(np.maximum(np.einsum("mii->mi", covariance), 0.0)))


def coverage_radius(
    covariance: Float[Array, "pose 3 3"], nu: Float[Array, "pose"], coverage: float = COVERAGE
) -> Float[Array, "pose"]:
    r"""Radius of the ball that holds the probability, for a normal distribution or its t-like kin.

    The squared distance is taken as :math:`g \\chi^2_h` with the same mean and variance, over
    :math:`\\chi^2_\\nu / \\nu` where the variance is itself estimated. Within 2 % of the exact
    radius for three coordinates.

    References
    ----------
    .. [1] F. E. Satterthwaite, Biometrics Bulletin 2(6), 1946.
    """
    from scipy.special import fdtri, gammaincinv

    trace = np.einsum("mii->m", covariance)
    squared = np.einsum("mij,mji->m", covariance, covariance)
    h = np.where(squared > 0, trace**2 / np.where(squared > 0, squared, 1.0), 1.0)
    normal = 2.0 * gammaincinv(h / 2.0, coverage) / h
    finite = np.isfinite(nu)
    estimated = fdtri(h, np.where(finite, np.maximum(np.floor(nu), 1.0), 1.0), coverage)
    return np.asarray(np.sqrt(trace * np.where(finite, estimated, normal)))
