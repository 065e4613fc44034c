import numpy as np
import pytest

from robocal.planning.observability import INDICES, observability

SIGMA = np.array([4.0, 2.0, 0.5])
# From document 002, eq. (6), by hand; O5 inverted as the list of its errors asks.
BY_HAND = {
    "O1": (4.0 * 2.0 * 0.5) ** (1 / 3) / np.sqrt(2),
    "O2": 0.125,
    "O3": 0.5,
    "O4": 0.0625,
    "O5": 1 / (0.25 + 0.5 + 2.0),
}


def jacobian_with(sigma, n_poses, n_rows, seed=0):
    rng = np.random.default_rng(seed)
    left, _ = np.linalg.qr(rng.normal(size=(n_poses * n_rows, len(sigma))))
    right, _ = np.linalg.qr(rng.normal(size=(len(sigma), len(sigma))))
    return (left * sigma @ right).reshape(n_poses, n_rows, len(sigma))


@pytest.mark.parametrize("name", INDICES)
def test_an_index_is_what_the_document_defines(name):
    assert observability(jacobian_with(SIGMA, 2, 3))[name] == pytest.approx(BY_HAND[name])


def test_a_set_measured_twice_is_as_good_a_pose_and_better_by_root_two_in_all():
    once = observability(jacobian_with(SIGMA, 2, 3))
    twice = observability(np.concatenate([jacobian_with(SIGMA, 2, 3)] * 2))
    for name, factor in {"O1": 1, "O2": 1, "O3": 2, "O4": 2, "O5": 2}.items():
        assert twice[name] == pytest.approx(once[name] * np.sqrt(factor))


@pytest.mark.parametrize("name", INDICES)
def test_a_set_that_leaves_a_parameter_open_is_worth_nothing(name):
    assert observability(jacobian_with(SIGMA, 2, 3)[:1, :2])[name] == pytest.approx(0.0, abs=1e-90)
