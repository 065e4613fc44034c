"""Poses at random: what the others are compared with."""

import numpy as np
from jaxtyping import Int
from numpy import ndarray as Array

from robocal.planning.chosen_set import Selection


def select(selection: Selection) -> Int[Array, "chosen"]:
    """Any candidates, each equally likely, in rising order."""
    rng = np.random.default_rng(selection.seed)
    return np.sort(rng.choice(len(selection.J), size=selection.count, replace=False))
