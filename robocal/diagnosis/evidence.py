r"""How strongly projected scores speak for a candidate.

With coefficients :math:`c \sim N(0, S)` of physical size and unit noise the Bayes factor against
"nothing more" is closed:

.. math:: \log BF = \tfrac12 b^T (M + S^{-1})^{-1} b - \tfrac12 \log\det(I + S M).
"""

import math

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array
from scipy.special import chdtri

_SIZES = (0.25, 0.5, 1.0)
"""Of a prior of several coefficients; [1]"""
_SEVERAL = 3
_BY_CHANCE = 0.01
"""Chance that declared noise leaves so much that it is no longer believed; [1]"""


def sizes_of(n_coefficients: int) -> tuple[float, ...]:
    """Shares of the stated prior that are tried, each as probable.

    A small effect is as likely as a large one. One normal law along three axes denies that: to
    less than half a standard deviation it gives 3 %.
    """
    return _SIZES if n_coefficients >= _SEVERAL else (1.0,)


def noise_scale(chi_square: float, nu: float) -> float:
    """Noise that candidates are judged by, in declared ones: never less than declared.

    An effect that just shows adds less to the sum of squares than chance does: it is judged by the
    declared noise, not by a noise that it is part of. Where what is left contradicts the declared
    noise, that is believed no more: everything left counts as noise, and where structure is
    plentiful selection ends when it is within the remainder. The price: noise that was stated a
    little too small of few rows goes unnoticed, and then names something in clean data more often.

    Parameters
    ----------
    chi_square
        Sum of the squared residuals, in declared noise.
    nu
        Their degrees of freedom.
    """
    if nu <= 0 or chi_square <= float(chdtri(nu, _BY_CHANCE)):
        return 1.0
    return math.sqrt(chi_square / nu)


def log_bayes_factor(
    M: Float[Array, "*#stack k k"],
    b: Float[Array, "*#stack k"],
    prior_std: Float[Array, "*#stack k"],
) -> Float[Array, "*_"]:
    """Log Bayes factors of a stack of candidates with equally many coefficients."""
    scaled = M * prior_std[..., :, None] * prior_std[..., None, :]
    inner = np.eye(M.shape[-1]) + scaled
    score = b * prior_std
    solved = np.linalg.solve(inner, score[..., None])[..., 0]
    fit = 0.5 * (score * solved).sum(axis=-1)
    return np.asarray(fit - 0.5 * np.linalg.slogdet(inner)[1])


def chi_square(M: Float[Array, "*#stack k k"], b: Float[Array, "*#stack k"]) -> Float[Array, "*_"]:
    """Score statistic b' M^-1 b; columns that the model already spans count nothing."""
    scale = np.sqrt(np.maximum(np.einsum("...kk->...k", M), 1e-300))
    scaled = M / (scale[..., :, None] * scale[..., None, :])
    values, vectors = np.linalg.eigh(scaled)
    along = np.einsum("...kj,...k->...j", vectors, b / scale)
    kept = values > 1e-8
    return np.asarray((along**2 * kept / np.where(kept, values, 1.0)).sum(axis=-1))


def log_mean_exp(values: Float[Array, "some"]) -> float:
    """Log of the mean of exponentials, without overflow."""
    top = values.max()
    return float(top + np.log(np.mean(np.exp(values - top))))


def log_sum_exp(values: Float[Array, "some"]) -> float:
    """Log of the sum of exponentials, without overflow."""
    top = values.max()
    return float(top + np.log(np.sum(np.exp(values - top))))
