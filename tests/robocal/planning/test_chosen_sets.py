import numpy as np
import pytest

from robocal.planning import detmax
from robocal.planning.chosen_set import Selection
from robocal.planning.determinant import DeterminantSet
from robocal.planning.observability import observability
from robocal.planning.selectors import MERITS, WORKSPACE, merit
from robocal.planning.spectrum import SpectrumSet


def worth(name, rows, test_rows, chosen):
    """Figure of merit by a singular value decomposition of the chosen rows, nothing updated."""
    J = rows.J[list(chosen)]
    if name != WORKSPACE:
        return observability(J)[name]
    flat = J.reshape(-1, J.shape[2])
    spread = test_rows @ np.linalg.pinv(flat)
    return -float((spread**2).sum(axis=(1, 2)).mean())


@pytest.mark.parametrize("name", MERITS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_pose_added_and_the_pose_removed_are_the_best_of_all(name, seed, rows, test_rows):
    chosen = np.random.default_rng(seed).choice(len(rows.J), size=20, replace=False).tolist()
    current = merit(name, test_rows)(rows.J)
    current.restart(tuple(chosen))
    added = current.best_addition()
    outside = [i for i in range(len(rows.J)) if i not in chosen]
    gains = {i: worth(name, rows, test_rows, [*chosen, i]) for i in outside}
    assert gains[added] == pytest.approx(max(gains.values()), rel=1e-9)
    removed = current.best_removal_after(added)
    grown = [*chosen, added]
    losses = {i: worth(name, rows, test_rows, [j for j in grown if j != i]) for i in grown}
    assert losses[removed] == pytest.approx(max(losses.values()), rel=1e-9)


@pytest.mark.parametrize("name", MERITS)
def test_after_many_changes_a_set_is_worth_what_a_fresh_one_is(name, rows, test_rows):
    rng = np.random.default_rng(5)
    current = merit(name, test_rows)(rows.J)
    current.restart(tuple(range(30)))
    for _ in range(150):
        leaving = rng.choice(np.array(current.chosen), size=2, replace=False)
        free = [i for i in range(len(rows.J)) if i not in current.chosen]
        coming = rng.choice(free, size=2, replace=False)
        current.change(tuple(leaving.tolist()), tuple(coming.tolist()))
    fresh = merit(name, test_rows)(rows.J)
    fresh.restart(current.chosen)
    # 150 updates of a matrix with condition 1e4 keep ten digits.
    assert current.value() == pytest.approx(fresh.value(), rel=1e-9)
    assert current.best_addition() == fresh.best_addition()


def test_updates_and_spectra_agree_on_the_determinant(rows, test_rows):
    updated, factorised = merit("O1", test_rows)(rows.J), SpectrumSet(rows.J, "O1")
    for current in (updated, factorised):
        current.restart(tuple(range(15)))
    for _ in range(20):
        assert updated.best_addition() == factorised.best_addition()
        added = updated.best_addition()
        removed = updated.best_removal_after(added)
        assert removed == factorised.best_removal_after(added)
        for current in (updated, factorised):
            current.change((current.chosen[0],), (added,))


@pytest.mark.parametrize("count", [0, 1, 4, 8])
def test_a_set_too_small_for_the_parameters_still_grows_by_the_best_pose(count, rows, test_rows):
    current = merit("O1", test_rows)(rows.J)
    current.restart(tuple(range(count)))
    added = current.best_addition()
    ridge = 1e-8 * np.eye(rows.J.shape[2])

    def logdet(chosen):
        flat = rows.J[chosen].reshape(-1, rows.J.shape[2])
        return np.linalg.slogdet(flat.T @ flat + ridge)[1]

    best = max(logdet([*range(count), i]) for i in range(count, len(rows.J)))
    assert logdet([*range(count), added]) == pytest.approx(best, abs=1e-5)


@pytest.mark.parametrize("name", ["O2", "O3", "O4", "O5"])
@pytest.mark.parametrize("seed", range(8))
def test_no_bound_hides_the_best_of_many_candidates_that_are_nearly_alike(name, seed):
    # Many more candidates than are factorised at a time, and eigenvalues close together: for one
    # seed in five the best candidate is not among the first by its bound.
    J = np.random.default_rng(seed).normal(size=(300, 2, 12))
    current = SpectrumSet(J, name)
    current.restart(tuple(range(12)))
    added = current.best_addition()
    best = max(range(12, 300), key=lambda i: observability(J[[*range(12), i]])[name])
    assert added == best


@pytest.mark.parametrize("name", MERITS)
def test_the_pose_that_replaces_another_is_the_best_of_all(name, rows, test_rows):
    chosen = np.random.default_rng(6).choice(len(rows.J), size=20, replace=False).tolist()
    current = merit(name, test_rows)(rows.J)
    current.restart(tuple(chosen))
    old, *kept = chosen
    new = current.best_addition_without(old)
    free = [i for i in range(len(rows.J)) if i not in kept]
    gains = {i: worth(name, rows, test_rows, [*kept, i]) for i in free}
    assert gains[new] == pytest.approx(max(gains.values()), rel=1e-9)


@pytest.mark.parametrize("count", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("kind", ["equal rows", "empty rows", "equal columns", "three kinds"])
def test_rows_that_depend_on_each_other_are_chosen_from_without_a_warning(kind, count):
    J = np.random.default_rng(1).normal(size=(30, 3, 6))
    if kind == "equal rows":
        J[:, 2] = J[:, 1]
    elif kind == "empty rows":
        J[:, 2] = 0.0
    elif kind == "equal columns":
        J[:, :, 5] = J[:, :, 4]
    else:
        J = np.repeat(J[:3], 10, axis=0)
    chosen = detmax.select(Selection(J, count, DeterminantSet, seed=1))
    assert len(set(chosen.tolist())) == count
