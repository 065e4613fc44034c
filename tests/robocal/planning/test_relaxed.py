import numpy as np
import pytest

from robocal.planning import detmax
from robocal.planning.chosen_set import Selection
from robocal.planning.observability import observability
from robocal.planning.relaxed import relaxed_design
from robocal.planning.selectors import merit


def test_a_parabola_is_best_measured_at_both_ends_and_in_the_middle():
    x = np.linspace(-1.0, 1.0, 21)
    design = relaxed_design(np.stack([np.ones_like(x), x, x**2], axis=1)[:, None, :])
    # Textbook optimum (Fedorov 1972): a third each at -1, 0, 1. The stop rule leaves 0.1 % in
    # log det, which the neighbours of the three points share.
    near = [design.weights[:2].sum(), design.weights[8:13].sum(), design.weights[-2:].sum()]
    assert near == pytest.approx([1 / 3] * 3, abs=0.02)
    # M = diag blocks of the textbook design: determinant 4/27.
    assert design.largest_index_1 == pytest.approx((4 / 27) ** (1 / 6), rel=2e-3)
    assert design.largest_index_1 >= (4 / 27) ** (1 / 6)


@pytest.mark.parametrize("count", [10, 25, 60])
def test_no_set_exceeds_the_bound(count, rows, test_rows):
    bound = relaxed_design(rows.J).largest_index_1
    chosen = detmax.select(Selection(rows.J, count, merit("O1", test_rows), seed=1))
    assert 0.8 * bound < observability(rows.J[chosen])["O1"] <= bound
