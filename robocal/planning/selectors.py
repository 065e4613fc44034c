"""The selectors and the figures of merit that a plan may name."""

from collections.abc import Callable
from functools import partial

from jaxtyping import Float
from numpy import ndarray as Array

from robocal.planning import at_random, detmax, greedy_exchange, relaxed
from robocal.planning.chosen_set import ChosenSet, Rows, Selector
from robocal.planning.determinant import DeterminantSet
from robocal.planning.observability import INDICES
from robocal.planning.prediction import PredictionSet
from robocal.planning.spectrum import SpectrumSet

SELECTORS: dict[str, Selector] = {
    "detmax": detmax.select,
    "exchange": greedy_exchange.select,
    "relaxed": relaxed.select,
    "random": at_random.select,
}
WORKSPACE = "workspace"
"""Merit: the predicted uncertainty of the tool over a workspace, the least."""
MERITS = (*INDICES, WORKSPACE)


def merit(name: str, test_rows: Float[Array, "test 3 parameter"]) -> Callable[[Rows], ChosenSet]:
    """What makes a set that knows the named figure of merit.

    Parameters
    ----------
    name
        One of `MERITS`.
    test_rows
        Position rows at poses of the workspace, for `WORKSPACE` alone [m].
    """
    if name == WORKSPACE:
        return partial(PredictionSet, test_rows=test_rows)
    if name == "O1":
        return DeterminantSet
    return partial(SpectrumSet, index=name)
