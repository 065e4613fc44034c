"""Greedy start, adding and deleting, then each pose in turn is exchanged until none moves.

References
----------
.. [1] V. V. Fedorov, *Theory of Optimal Experiments*, Academic Press, 1972 (exchange).
"""

import numpy as np
from jaxtyping import Int
from numpy import ndarray as Array

from robocal.planning.chosen_set import SAME, Selection, improve
from robocal.planning.determinant import DeterminantSet

_MAX_SWEEPS = 20


def select(selection: Selection) -> Int[Array, "chosen"]:
    """Candidates of the set found, in rising order."""
    # The other indices are zero until a set has full rank, so the determinant leads to it.
    growing = DeterminantSet(selection.J)
    for _ in range(selection.count):
        growing.change((), (growing.best_addition(),))
    current = selection.merit(selection.J)
    current.restart(growing.chosen)
    improve(current)
    value = current.value()
    for _ in range(_MAX_SWEEPS):
        for old in current.chosen:
            new = current.best_addition_without(old)
            if new != old:
                current.change((old,), (new,))
        before, value = value, current.value()
        if value <= before + SAME * abs(before):
            break
    return np.array(sorted(current.chosen))
