"""Many fits at once beside one fit after another, and their derivatives beside differences."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.identification.cell_model import CellModel
from robocal.identification.least_squares import Prior, levenberg_marquardt
from robocal.identification.observations import Observations
from robocal.identification.problem import normal_equations
from robocal.uncertainty.budget import Budget
from robocal.uncertainty.many_cells import draws_at_place, many_jacobians, many_targets
from robocal.uncertainty.many_fits import Estimator, Readings, fit_many
from robocal.uncertainty.monte_carlo import block_generator
from robocal.uncertainty.refits import piece_size, refit, refit_piece
from robocal.uncertainty.repeats import Repeats
from robocal.uncertainty.simulated_readings import clean_readings, simulate_readings
from tests.elementary_kinematics import load_arm, random_frame
from tests.robocal.uncertainty.campaign_bundles import campaign

NO_REPEATS = Repeats(None, None)
DRAWS = 4


def mixed_rows(rng: np.random.Generator, q: np.ndarray) -> Observations:
    """Full poses, positions at two nests, and lengths, all in one set."""
    n = len(q)
    kind = np.arange(n) % 3
    return Observations(
        joints=q,
        position=np.zeros((3, n)),
        axes=np.zeros((3, 3, n)),
        distance=np.zeros(n),
        place=np.where(kind == 1, np.arange(n) % 2, -1),
        position_weight=np.where(kind == 2, 0.0, 1 / 2e-5),
        orientation_weight=np.where(kind == 0, 1 / 5e-5, 0.0),
        distance_weight=np.where(kind == 2, 1 / 2e-5, 0.0),
    )


def mixed_cell(robot: str, rng: np.random.Generator) -> CellModel:
    from robocal.robots.library import load_robot

    geometry = load_robot(robot).geometry
    geometry = replace(
        geometry,
        station=random_frame(rng, 2.0),
        mount=random_frame(rng, 0.2),
        flange=random_frame(rng, 0.1),
    )
    return CellModel(
        geometry, geometry.flange, ("n1", "n2"), rng.normal(size=(2, 3)) * 0.1, rng.normal(size=3)
    )


@pytest.mark.parametrize("robot", ["ur10e", "abb_irb910sc"])
def test_every_draw_ends_where_levenberg_marquardt_ends(robot):
    """Nests, lengths, poses; the same minimum by the project's other solver, one by one."""
    rng = np.random.default_rng(3)
    cell = mixed_cell(robot, rng)
    q = load_arm(robot).draw(rng, 60, widest=2.0)
    rows = mixed_rows(rng, q)
    free = np.arange(len(cell.names))
    std = np.where(cell.is_angle, 5e-3, 1e-3)
    truths = cell.vector[:, None] + 0.3 * std[:, None] * rng.normal(size=(len(free), DRAWS))
    clean = clean_readings(cell, truths, rows)
    readings = Readings(
        clean.position + 2e-5 * rng.normal(size=clean.position.shape), clean.axes,
        clean.distance + 2e-5 * rng.normal(size=clean.distance.shape),
    )  # fmt: skip
    precision = std**-2.0
    mean = np.repeat(cell.vector[:, None], DRAWS, axis=1)
    found = fit_many(Estimator(cell, rows, free, precision), readings, mean)
    assert found.settled.all()
    for draw in range(DRAWS):
        own = replace(
            rows,
            position=readings.position[:, draw],
            axes=readings.axes[:, :, draw],
            distance=readings.distance[draw],
        )
        minimum = levenberg_marquardt(
            lambda x, own=own: normal_equations(cell.with_vector(x), own, free),
            cell.vector,
            Prior(cell.vector, precision),
        )
        covariance = np.linalg.inv(minimum.hessian)
        away = (found.vectors[:, draw] - minimum.x) / np.sqrt(np.diag(covariance))
        assert np.abs(away).max() < 1e-3
        np.testing.assert_allclose(np.diag(found.covariance[draw]), np.diag(covariance), rtol=1e-3)
        assert found.chi_square[draw] == pytest.approx(2 * minimum.equations.cost, rel=1e-4)


@pytest.mark.parametrize("place", [-1, 1])
def test_derivatives_of_many_draws_agree_with_central_differences(place):
    rng = np.random.default_rng(1)
    cell = mixed_cell("staubli_tx60", rng)
    q = load_arm("staubli_tx60").draw(rng, 3)
    vectors = cell.vector[:, None] + 0.05 * rng.normal(size=(len(cell.names), 2))
    model, mine = draws_at_place(cell, vectors, place)
    J = many_jacobians(many_targets(model, mine, q))
    step = 1e-6
    for parameter in range(len(mine)):
        moved = [mine.copy(), mine.copy()]
        moved[0][parameter] += step
        moved[1][parameter] -= step
        up, down = (many_targets(model, vector, q).target for vector in moved)
        np.testing.assert_allclose(J[parameter, :3], (up.p - down.p) / (2 * step), atol=1e-8)
        middle = many_targets(model, mine, q).target
        turn = 0.5 * sum(
            np.cross(getattr(middle, axis), (getattr(up, axis) - getattr(down, axis)), axis=0)
            for axis in "xyz"
        ) / (2 * step)  # fmt: skip
        np.testing.assert_allclose(J[parameter, 3:], turn, atol=1e-8)


def test_simulated_readings_scatter_as_declared(tmp_path):
    """Position by range, orientation, target once a visit, scale once a campaign; 2 % of 6,000."""
    fit = campaign(tmp_path, rows=30).fit
    rows, noise = fit.rows, fit.bundle.instrument
    truths = np.repeat(fit.cell.vector[:, None], 200, axis=1)
    rng = np.random.default_rng(1)
    visit = np.arange(30) // 2
    clean = clean_readings(fit.cell, truths, rows).position
    ranges = np.linalg.norm(clean[:, 0], axis=0)

    def errors(budget: Budget) -> np.ndarray:
        made = simulate_readings(fit.cell, truths, rows, visit, noise, budget, rng)
        return made.position - clean

    own = errors(Budget())
    declared = np.hypot(noise.fixed, noise.per_range * ranges)
    assert (own / declared).std() == pytest.approx(1.0, rel=0.02)
    shared = errors(Budget(target=1e-3)).reshape(3, 200, 15, 2)
    assert shared.mean(axis=3).std() == pytest.approx(1e-3, rel=0.03)
    assert np.diff(shared, axis=3).std() < 5e-5
    stretched = errors(Budget(scale=1e-3)) / clean
    assert np.median(stretched, axis=(0, 2)).std() == pytest.approx(1e-3, rel=0.15)


def test_refits_do_not_depend_on_who_makes_the_pieces(tmp_path):
    """Pieces made in another order, and by other processes, are the same to the last bit."""
    fit = campaign(tmp_path, rows=30).fit
    size = piece_size(fit)
    whole = refit(fit, NO_REPEATS, 2 * size, seed=4).moves
    second, first = (
        refit_piece(fit, NO_REPEATS, size, block_generator(4, piece)).moves for piece in (1, 0)
    )
    np.testing.assert_array_equal(whole, np.concatenate([first, second], axis=1))
