r"""When something is there that has a name, and not noise alone.

.. math:: \log \sum_n E_n + w \log \frac{\max_n E_n}{\sum_n E_n}

with :math:`E_n` the Bayes factor of a name, an effect at a joint, times its prior. Noise spreads
its little evidence over many names, a cause puts it on its own. Total evidence alone is the best
test there is of anything; but what it alone shows can hardly be named.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.group import Group
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.screen import evidence_by_name, screen
from robocal.progress import tell

CLEARNESS = 7.0
"""Weight of the best name's share; 5 and 9 served no better on development seeds; [1]"""


def named_evidence(groups: list[Group]) -> Float[Array, "residual"]:
    """Log evidence for one cause against nothing more, less what it lacks of a clear name."""
    each = np.stack(list(evidence_by_name(groups).values()))
    total = np.logaddexp.reduce(each, axis=0)
    return np.asarray(total + CLEARNESS * (each.max(axis=0) - total))


def null_threshold(
    rows: Circumstances, fit: Linearised, chance: float, draws: int, seed: int
) -> float:
    """Named evidence that noise alone exceeds with this chance.

    Estimated from simulated residuals, projected like real ones; the upper tail is taken as
    exponential beyond its upper tenth, so that few draws give a steady figure.
    """
    tell("what noise alone would show")
    z = np.random.default_rng(seed).normal(size=(len(fit.r), draws))
    z -= fit.basis @ (fit.basis.T @ z)
    evidence = np.sort(named_evidence(screen(rows, fit, z)))
    tenth = evidence[int(0.9 * draws) :]
    scale = float(np.mean(tenth - tenth[0]))
    return float(tenth[0] + scale * np.log(0.1 / chance))
