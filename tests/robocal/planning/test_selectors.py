from importlib import import_module
from itertools import combinations
from pathlib import Path
from pkgutil import iter_modules

import numpy as np
import pytest

import robocal.planning
from robocal.planning import detmax
from robocal.planning.chosen_set import Selection
from robocal.planning.observability import INDICES, observability
from robocal.planning.selectors import MERITS, SELECTORS, merit

COUNT = 18


@pytest.fixture
def selection(rows, test_rows):
    return Selection(rows.J, COUNT, merit("O1", test_rows), seed=1)


def test_every_module_that_selects_is_registered():
    folder = Path(robocal.planning.__file__).parent
    modules = [import_module(f"robocal.planning.{m.name}") for m in iter_modules([str(folder)])]
    selecting = {module.select for module in modules if hasattr(module, "select")}
    assert selecting == set(SELECTORS.values())


@pytest.mark.parametrize("name", SELECTORS)
def test_a_selector_returns_so_many_different_candidates_and_the_same_for_a_seed(name, selection):
    chosen = SELECTORS[name](selection)
    assert len(set(chosen.tolist())) == COUNT
    assert chosen.tolist() == sorted(chosen.tolist())
    assert chosen.min() >= 0
    assert chosen.max() < len(selection.J)
    assert SELECTORS[name](selection).tolist() == chosen.tolist()


@pytest.mark.parametrize("name", INDICES)
def test_detmax_is_at_least_as_good_as_exchange_weights_and_a_thousand_random_sets(
    name, rows, test_rows
):
    selection = Selection(rows.J, COUNT, merit(name, test_rows), seed=1)
    found = observability(rows.J[SELECTORS["detmax"](selection)])[name]
    rng = np.random.default_rng(0)
    others = [SELECTORS["exchange"](selection), SELECTORS["relaxed"](selection)]
    others += [rng.choice(len(rows.J), size=COUNT, replace=False) for _ in range(1000)]
    assert found >= max(observability(rows.J[other])[name] for other in others) * (1 - 1e-9)


def test_detmax_finds_the_best_of_all_sets_where_all_can_be_tried():
    x = np.linspace(-1.0, 1.0, 13)
    J = np.stack([np.ones_like(x), x, x**2], axis=1)[:, None, :]
    everything = combinations(range(len(x)), 5)
    best = max(observability(J[list(chosen)])["O1"] for chosen in everything)
    chosen = detmax.select(Selection(J, 5, merit("O1", np.empty((0, 3, 3))), seed=2))
    assert observability(J[chosen])["O1"] == pytest.approx(best, rel=1e-12)


@pytest.mark.parametrize("name", MERITS)
def test_no_single_exchange_by_adding_and_deleting_betters_the_set_of_detmax(name, rows, test_rows):
    make = merit(name, test_rows)
    current = make(rows.J)
    chosen = detmax.select(Selection(rows.J, COUNT, make, seed=4))
    current.restart(tuple(chosen.tolist()))
    before = current.value()
    added = current.best_addition()
    removed = current.best_removal_after(added)
    current.change((removed,), (added,)) if removed != added else None
    assert current.value() <= before + 1e-9 * abs(before)


def test_more_patience_never_makes_the_set_worse(selection):
    worth = [
        observability(
            selection.J[detmax.search_from_random(selection, detmax.DetmaxSettings(a=d, d=d))]
        )["O1"]
        for d in (1, 10, 40)
    ]
    # The searches share their beginning, so the longer one has seen all that the shorter saw.
    assert worth == sorted(worth)
