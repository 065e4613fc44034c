"""How many poses it takes until the tool is known well enough all over the workspace."""

from collections.abc import Callable

from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.errors import NoAnswer
from robocal.planning.chosen_set import ChosenSet, Rows, Selection, Selector
from robocal.planning.pose_rows import PoseRows
from robocal.planning.prediction import predicted_radius

_LARGEST_SHARE = 0.5
"""Share of the candidates up to which sets are tried: beyond it a choice is hardly one; [1]"""


def poses_until(
    rows: PoseRows,
    test_rows: Float[Array, "test 3 parameter"],
    uncertainty: float,
    merit: Callable[[Rows], ChosenSet],
    select: Selector,
    seed: int,
) -> Int[Array, "chosen"]:
    """The smallest selected set whose predicted radius is small enough at every test pose.

    The number is found by doubling and halving; as a search may miss the best set of a size, one
    pose fewer can now and then do as well.

    Parameters
    ----------
    rows
        Candidates.
    test_rows
        Position rows at the test poses [m].
    uncertainty
        Largest radius allowed [m].
    merit, select, seed
        As in `Selection`.

    Raises
    ------
    NoAnswer
        If half of the candidates are not enough.
    """

    def attempt(count: int) -> tuple[Int[Array, "chosen"], float]:
        chosen = select(Selection(rows.J, count, merit, seed))
        return chosen, float(predicted_radius(rows.J, chosen, test_rows).max())

    most = int(_LARGEST_SHARE * len(rows.J))
    low, count = rows.fewest, min(rows.fewest + 1, most)
    chosen, radius = attempt(count)
    while radius > uncertainty:
        if count == most:
            raise NoAnswer(
                f"with {count} of {len(rows.J)} candidates the predicted radius still is "
                f"{radius * 1e3:.4f} mm somewhere in the workspace, {uncertainty * 1e3:.4f} mm is "
                "wanted; take a better instrument, more candidates or a smaller workspace"
            )
        low, count = count, min(2 * count, most)
        chosen, radius = attempt(count)
    while count - low > 1:
        middle = (low + count) // 2
        other, radius = attempt(middle)
        if radius > uncertainty:
            low = middle
        else:
            count, chosen = middle, other
    return chosen
