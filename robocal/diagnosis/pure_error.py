r"""Lack of fit against pure error: what repeats of one pose say of noise and model.

Repeats scatter by noise alone, whatever the model gets wrong about their pose. With
:math:`SS_{PE}` their squares about their means and :math:`\nu_{PE}` degrees of freedom,

.. math:: F = \frac{(SS - SS_{PE}) / (\nu - \nu_{PE})}{SS_{PE} / \nu_{PE}}

is large where the model lacks something, however large the noise is [1]_. What changes between
repeats, such as time and temperature, counts as pure error.

References
----------
.. [1] N. R. Draper, H. Smith, *Applied Regression Analysis*, 3rd ed., Wiley 1998, 2.1.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array
from scipy.special import fdtrc, gammaincc

from robocal.diagnosis.joint_fit import JointFit

DOUBT = 0.01
"""Chance below which the repeats contradict what is tested by them; [1]"""


@dataclass(frozen=True)
class PureError:
    """What the repeats say."""

    ratio: float
    """Their variance over the declared one; [1]"""
    nu: int
    """Degrees of freedom."""
    geometry_p: float
    """Chance of the lack of fit that geometry leaves, were it none; [1]"""
    model_p: float
    """The same with the effects; [1]"""

    @property
    def is_larger_than_declared(self) -> bool:
        """Whether repeats scatter by more than the declared noise."""
        return float(gammaincc(0.5 * self.nu, 0.5 * self.nu * self.ratio)) < DOUBT

    @property
    def is_all_that_is_left(self) -> bool:
        """Whether the declared noise is contradicted, and the model is not."""
        return self.is_larger_than_declared and self.model_p >= DOUBT

    @property
    def lack_of_fit(self) -> str:
        """Both lacks of fit, for people."""
        return (
            f"lack of fit against repeats ({self.nu} degrees of freedom): "
            f"p {self.geometry_p:.2g} by geometry, {self.model_p:.2g} with the causes"
        )

    @property
    def sentence(self) -> str:
        """What a contradicted noise means, for people."""
        times = np.sqrt(self.ratio)
        return (
            f"repeats of one pose scatter by {times:.2g} times the declared noise "
            f"({self.nu} degrees of freedom): it is stated too small, or something changes "
            "between repeats"
        )


def pure_error(geometric: JointFit, found: JointFit, visit: Int[Array, "row"]) -> PureError | None:
    """Judge both fits by the repeats; None where none are among the rows.

    Parameters
    ----------
    geometric, found
        The fit without effects, and with them.
    visit
        A number for every row; repeats share it.
    """
    squares, nu = _about_means(found, visit)
    if nu == 0 or squares == 0.0:
        return None
    before, _ = _about_means(geometric, visit)
    return PureError(
        squares / nu, nu, _lack_of_fit(geometric, before, nu), _lack_of_fit(found, squares, nu)
    )


def _about_means(fit: JointFit, visit: Int[Array, "row"]) -> tuple[float, int]:
    """Squares of the residuals about the means of repeats, and their degrees of freedom."""
    line = fit.fit
    measured = (line.W != 0.0).any(axis=0)
    component = np.arange(len(line.row)) - line.first_scalar[line.row]
    key = np.stack([visit[line.row], component])[:, measured]
    _, group = np.unique(key, axis=1, return_inverse=True)
    group, r = group.ravel(), line.r[measured]
    mean: Float[Array, "group"] = np.bincount(group, r) / np.bincount(group)
    away = r - mean[group]
    return float(away @ away), len(r) - len(mean)


def _lack_of_fit(fit: JointFit, squares: float, nu: int) -> float:
    left = fit.nu - nu
    if left <= 0:
        return 1.0
    F = max(fit.chi_square - squares, 0.0) / left / (squares / nu)
    return float(fdtrc(left, nu, F))
