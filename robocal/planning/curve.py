r"""The indices of random sets against the number of poses, and the number where they settle.

Document 002 draws 50 random sets a point and takes the number at which an index settles, by eye.
Here: the first number from which doubling the poses would raise the mean index by less than
`SETTLED`, read from a line through :math:`\ln O` over :math:`\ln\mu` between that number and twice
it. O1 and O2 tend to a limit and settle; O3, O4 and O5 grow as the root of the number for ever.

References
----------
.. [1] X. Wen et al., Chinese Journal of Scientific Instrument, 2022, sections 2.2 and 4.2.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.planning.chosen_set import Rows
from robocal.planning.observability import INDICES
from robocal.progress import counted

DRAWS = 50
"""Random sets a point"""
MOST_POSES = 160
"""Where the curve ends"""
_ZERO = 1e-12
"""An index below this belongs to sets without full rank; [1]"""
SETTLED = 0.05
"""Rise of an index over a doubling of the poses that counts as none; [1]"""


@dataclass(frozen=True)
class IndexCurve:
    """Mean index of random sets."""

    counts: Int[Array, "count"]
    mean: dict[str, Float[Array, "count"]]
    std: dict[str, Float[Array, "count"]]
    """Standard deviation over the draws."""

    def settled_count(self, index: str) -> int | None:
        """Fewest poses from which the index has settled; None where it does not."""
        for count in self.counts[2 * self.counts <= self.counts[-1]]:
            window = (self.counts >= count) & (self.counts <= 2 * count)
            x = np.log(self.counts[window])
            y = np.log(np.maximum(self.mean[index][window], _ZERO))
            if np.expm1(np.polyfit(x, y, 1)[0] * np.log(2.0)) < SETTLED:
                return int(count)
        return None


def index_curve(J: Rows, seed: int, most: int = MOST_POSES, draws: int = DRAWS) -> IndexCurve:
    """Indices of random sets of every size from the fewest poses that can determine anything.

    Parameters
    ----------
    J
        Scaled rows of the candidates.
    seed
        Of the draws.
    most
        Largest set, not more than there are candidates.
    draws
        Sets a point.
    """
    rng = np.random.default_rng(seed)
    n_poses, n_rows, n_parameters = J.shape
    counts = np.arange(-(-n_parameters // n_rows), min(most, n_poses) + 1)
    values = np.empty((len(INDICES), len(counts), draws))
    own = np.swapaxes(J, 1, 2) @ J
    for point, count in enumerate(counted("index of random sets", counts, len(counts))):
        sets = [rng.choice(n_poses, size=count, replace=False) for _ in range(draws)]
        M = np.stack([own[chosen].sum(axis=0) for chosen in sets])
        sigma = np.sqrt(np.maximum(np.linalg.eigvalsh(M), 0.0))
        for row, index in enumerate(INDICES.values()):
            values[row, point] = index(sigma, int(count))
    return IndexCurve(
        counts,
        dict(zip(INDICES, values.mean(axis=2), strict=True)),
        dict(zip(INDICES, values.std(axis=2, ddof=1), strict=True)),
    )
