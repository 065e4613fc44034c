r"""The five observability indices of a set of poses, from singular values of the scaled Jacobian.

With :math:`\sigma_1 \ge \dots \ge \sigma_L` of the rows of :math:`\mu` poses, columns scaled:

.. math::
   O_1 = \frac{(\sigma_1 \cdots \sigma_L)^{1/L}}{\sqrt\mu},\quad
   O_2 = \frac{\sigma_L}{\sigma_1},\quad O_3 = \sigma_L,\quad
   O_4 = \frac{\sigma_L^2}{\sigma_1},\quad
   O_5 = \frac{1}{1/\sigma_1 + \dots + 1/\sigma_L}.

For all five larger is better: [1]_ prints the sum alone as O5, its inverse is what [2]_ defines.

References
----------
.. [1] X. Wen et al., Chinese Journal of Scientific Instrument, 2022, eq. (6).
.. [2] Y. Sun, J. M. Hollerbach, "Observability index selection for robot calibration", ICRA 2008.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

SingularValues = Float[Array, "*stack sigma"]
Index = Callable[[SingularValues, int], Float[Array, "*stack"]]
_TINY = 1e-300


def index_1(sigma: SingularValues, count: int) -> Float[Array, "*stack"]:
    """Geometric mean of the singular values over the root of the number of poses (D-optimal)."""
    return np.asarray(np.exp(np.log(np.maximum(sigma, _TINY)).mean(axis=-1)) / np.sqrt(count))


def index_2(sigma: SingularValues, count: int) -> Float[Array, "*stack"]:
    """Inverse condition number."""
    return np.asarray(sigma.min(axis=-1) / np.maximum(sigma.max(axis=-1), _TINY))


def index_3(sigma: SingularValues, count: int) -> Float[Array, "*stack"]:
    """Smallest singular value (E-optimal)."""
    return np.asarray(sigma.min(axis=-1))


def index_4(sigma: SingularValues, count: int) -> Float[Array, "*stack"]:
    """Noise amplification index."""
    return np.asarray(sigma.min(axis=-1) ** 2 / np.maximum(sigma.max(axis=-1), _TINY))


def index_5(sigma: SingularValues, count: int) -> Float[Array, "*stack"]:
    """Inverse of the sum of inverses (kin to A-optimal)."""
    return np.asarray(1.0 / (1.0 / np.maximum(sigma, _TINY)).sum(axis=-1))


INDICES: dict[str, Index] = {
    "O1": index_1,
    "O2": index_2,
    "O3": index_3,
    "O4": index_4,
    "O5": index_5,
}


def observability(J: Float[Array, "pose row parameter"]) -> dict[str, float]:
    """All indices of a set of poses.

    Parameters
    ----------
    J
        Rows of every pose of the set, columns scaled.

    Examples
    --------
    >>> observability(np.diag([4.0, 1.0])[None])["O2"]
    0.25
    """
    n_poses, n_rows, n_parameters = J.shape
    sigma = np.zeros(n_parameters)
    found = np.linalg.svd(J.reshape(n_poses * n_rows, n_parameters), compute_uv=False)
    sigma[: len(found)] = found
    return {name: float(index(sigma, n_poses)) for name, index in INDICES.items()}
