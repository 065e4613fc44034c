import numpy as np
import pytest

from robocal.errors import NoAnswer
from robocal.planning import greedy_exchange
from robocal.planning.chosen_set import Selection
from robocal.planning.number import poses_until
from robocal.planning.prediction import coverage_radius, predicted_radius
from robocal.planning.selectors import merit


def select_for(name, rows, test_rows, count=18):
    return greedy_exchange.select(Selection(rows.J, count, merit(name, test_rows), seed=1))


def test_the_predicted_radius_holds_95_percent_of_refits(rows, test_rows):
    chosen = np.arange(25)
    radius = predicted_radius(rows.J, chosen, test_rows)
    flat = rows.J[chosen].reshape(-1, rows.J.shape[2])
    noise = np.random.default_rng(1).normal(size=(len(flat), 4000))
    refits = np.linalg.lstsq(flat, noise, rcond=None)[0]
    away = np.linalg.norm(test_rows @ refits, axis=1)
    inside = (away <= radius[:, None]).mean(axis=1)
    # 4000 draws: standard deviation 0.35 %; the approximation itself is good to about 1 %.
    assert inside.mean() == pytest.approx(0.95, abs=0.01)
    assert np.abs(inside - 0.95).max() < 0.025


@pytest.mark.parametrize(
    ("variances", "factor"), [((1, 1, 1), 2.7955), ((1, 0, 0), 1.9600), ((1, 1, 0), 2.4477)]
)
def test_the_radius_is_exact_for_one_two_and_three_equal_axes(variances, factor):
    # Roots of the 95 % points of chi-square with 3, 1 and 2 degrees of freedom.
    found = coverage_radius(np.diag(np.array(variances, dtype=float))[None])
    assert found[0] == pytest.approx(factor, abs=1e-3)


def test_the_workspace_selector_predicts_less_than_the_indices_where_it_matters(rows, test_rows):
    here = test_rows[:8]
    spread = {
        name: predicted_radius(rows.J, select_for(name, rows, here), here).mean()
        for name in ("workspace", "O1", "O2", "O3")
    }
    assert min(spread, key=spread.__getitem__) == "workspace"


def test_the_number_of_poses_brings_the_uncertainty_below_what_was_asked(rows, test_rows):
    make = merit("O1", test_rows)
    wanted = 1.3 * predicted_radius(rows.J, np.arange(40), test_rows).max()
    chosen = poses_until(rows, test_rows, wanted, make, greedy_exchange.select, seed=1)
    fewer = greedy_exchange.select(Selection(rows.J, len(chosen) - 1, make, seed=1))
    assert predicted_radius(rows.J, chosen, test_rows).max() <= wanted
    assert predicted_radius(rows.J, fewer, test_rows).max() > wanted


def test_an_uncertainty_out_of_reach_is_no_answer_and_says_what_can_be_had(rows, test_rows):
    with pytest.raises(NoAnswer, match=r"0.0001 mm is wanted; take a better instrument"):
        poses_until(rows, test_rows, 1e-7, merit("O1", test_rows), greedy_exchange.select, seed=1)
