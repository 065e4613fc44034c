import numpy as np
import pytest

from robocal.planning.factors import approach_directions, payload_halves, repeated_poses


def unexplained(rows, chosen, signs):
    """Log determinant of what the geometry leaves of the backlash columns, by least squares."""
    moves = rows.moves[chosen]
    moves = moves / np.linalg.norm(moves, axis=(0, 1))
    columns = (moves * signs[:, None, :]).reshape(-1, moves.shape[2])
    geometry = rows.J[chosen].reshape(-1, rows.J.shape[2])
    fitted = geometry @ np.linalg.lstsq(geometry, columns, rcond=None)[0]
    left = columns - fitted
    return np.linalg.slogdet(left.T @ left)[1]


@pytest.mark.parametrize("count", [30, 31])
def test_every_joint_comes_from_either_side_equally_often(rows, count):
    signs = approach_directions(rows, np.arange(count), seed=1)
    assert set(np.unique(signs)) == {-1, 1}
    assert set(signs.sum(axis=0)) <= {count % 2}


def test_backlash_is_less_confounded_with_geometry_than_by_chance(rows):
    chosen = np.arange(30)
    found = unexplained(rows, chosen, approach_directions(rows, chosen, seed=1))
    rng = np.random.default_rng(0)
    random = [unexplained(rows, chosen, rng.choice([-1, 1], size=(30, 6))) for _ in range(200)]
    assert found > np.quantile(random, 0.95)


def test_either_payload_alone_determines_the_geometry(rows):
    chosen = np.arange(30)
    half = payload_halves(rows.J, chosen, seed=1)
    assert half.sum() == 15
    values = []
    for part in (0, 1):
        flat = rows.J[chosen][half == part].reshape(-1, rows.J.shape[2])
        values.append(np.linalg.slogdet(flat.T @ flat)[1])
    rng = np.random.default_rng(0)
    own = np.swapaxes(rows.J[chosen], 1, 2) @ rows.J[chosen]
    random = []
    for _ in range(200):
        first = np.isin(np.arange(30), rng.permutation(30)[:15])
        random.append(sum(np.linalg.slogdet(own[f].sum(axis=0))[1] for f in (first, ~first)))
    assert sum(values) > np.quantile(random, 0.95)


def test_repeats_go_to_different_poses_first_and_to_one_that_says_most(rows):
    chosen = np.arange(30)
    further = repeated_poses(rows.J, chosen, 7)
    assert further.sum() == 7
    assert further.max() == 1
    flat = rows.J[chosen].reshape(-1, rows.J.shape[2])
    M = flat.T @ flat
    gains = [np.linalg.slogdet(M + J.T @ J)[1] for J in rows.J[chosen]]
    assert further[int(np.argmax(gains))] == 1
    assert sorted(set(repeated_poses(rows.J, chosen, 40))) == [1, 2]
