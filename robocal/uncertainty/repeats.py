r"""Type A evaluation: the scatter of repeats of one pose about their own mean.

Whatever the model gets wrong is the same for all repeats of a pose, so their scatter is the noise
of instrument and robot alone (pure error). Its square over the declared variance follows
:math:`\chi^2_\nu / \nu` where the declaration is right.

References
----------
.. [1] JCGM 100:2008 (GUM), 4.2 and H.3.6 (pooling).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array
from scipy.special import gammainc, gammaincc

from robocal.identification.problem import residuals
from robocal.uncertainty.fitted_rows import FittedRows

DOUBT = 0.01
"""Chance below which a declared scatter counts as contradicted by the repeats; [1]"""


@dataclass(frozen=True)
class Scatter:
    """Pooled scatter of one kind of reading."""

    std: float
    """Experimental standard deviation of one component, pooled over the poses [m or rad]."""
    ratio: float
    """Variance of the repeats over the declared one; [1]"""
    nu: int
    """Degrees of freedom."""

    @property
    def chance(self) -> float:
        """Two-sided chance of a ratio so far from one, were the declaration right."""
        square = 0.5 * self.nu * self.ratio
        below = float(gammainc(0.5 * self.nu, square))
        return 2.0 * min(below, float(gammaincc(0.5 * self.nu, square)))

    @property
    def contradicts(self) -> bool:
        """Whether the declared scatter is wrong."""
        return self.chance < DOUBT


@dataclass(frozen=True)
class Repeats:
    """Scatter of positions and of orientations; None without repeats."""

    position: Scatter | None
    orientation: Scatter | None


def scatter_of_repeats(fit: FittedRows) -> Repeats:
    """Pool the repeats of all poses.

    Rows repeat each other where pose, nest, payload and the directions of approach agree.
    """
    found = residuals(fit.cell, fit.rows)
    noise = fit.bundle.instrument
    ranges = np.linalg.norm(fit.rows.position, axis=0)
    position_std = np.sqrt(
        noise.fixed**2 + noise.repeatability**2 + (noise.per_range * ranges) ** 2
    )
    orientation_std = np.full(len(fit.rows), noise.orientation_std())
    group = fit.measured.visit
    return Repeats(
        _pooled(found.position, position_std, group, fit.rows.position_weight > 0),
        _pooled(found.orientation, orientation_std, group, fit.rows.orientation_weight > 0),
    )


def _pooled(
    deviation: Float[Array, "3 row"],
    std: Float[Array, "row"],
    group: Int[Array, "row"],
    there: Array,
) -> Scatter | None:
    if not there.any():
        return None
    deviation, std, group = deviation[:, there], std[there], group[there]
    weight = 1.0 / std**2
    total = np.bincount(group, weight)
    away = np.stack([
        part - (np.bincount(group, weight * part) / np.maximum(total, 1e-300))[group]
        for part in deviation
    ])
    nu = 3 * (len(group) - len(np.unique(group)))
    if nu == 0:
        return None
    ratio = float((away**2 * weight).sum()) / nu
    return Scatter(float(np.sqrt((away**2).sum() / nu)), ratio, nu)
