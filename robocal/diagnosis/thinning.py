"""Some rows that stand for all, evenly spread, where all would take too long."""

import numpy as np
from jaxtyping import Bool, Int
from numpy import ndarray as Array


def evenly(n: int, most: int) -> Bool[Array, "row"]:
    """At most so many of n rows."""
    return chosen_rows(np.linspace(0, n - 1, min(n, most)).astype(int), n)


def chosen_rows(index: Int[Array, "some"], n: int) -> Bool[Array, "row"]:
    """True at some of n rows."""
    chosen: Bool[Array, "row"] = np.zeros(n, dtype=bool)
    chosen[index] = True
    return chosen
