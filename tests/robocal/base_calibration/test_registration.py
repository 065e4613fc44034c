"""Registration: exact where it can be, sure as it says, and open where it says so."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robocal.base_calibration.faults import examine
from robocal.base_calibration.monte_carlo import draw_registrations
from robocal.base_calibration.next_touch import Travel, best_next_touch
from robocal.base_calibration.registration import register
from robocal.base_calibration.solution import solve
from robocal.base_calibration.stage import Stage
from robocal.errors import NoAnswer
from tests.robocal.base_calibration.stage_cell import (
    LEVEL_CELL,
    TILTED_CELL,
    Cell,
    Faults,
    Plan,
    frame,
    short_plan,
    simulate,
    wide_plan,
    within_prior,
)

STAGE = Stage(0.05e-3, 0.02e-3, 0.1e-3, level_in_master=False, level_in_slave=False)
LEVEL = replace(STAGE, level_in_master=True, level_in_slave=True)


def noiseless(cell: Cell, plan: Plan, faults: Faults):
    exact = replace(cell, sigma_tip=0.0, sigma_slide=0.0, sigma_rod=0.0, sigma_angle=0.0)
    touches = simulate(exact, plan, faults, np.random.default_rng(0))
    return replace(touches, tip_covariance=np.eye(3 * len(touches)) * 1e-10)


def random_cell(rng: np.random.Generator) -> Cell:
    frames = [frame(rng.uniform(-3, 3, 3), Rotation.random(rng=rng).as_rotvec()) for _ in range(2)]
    return Cell([frames[0]], frames[1])


def standard_deviations(solution) -> np.ndarray:
    slave = solution.state.slave_columns
    return np.sqrt(np.diag(solution.covariance)[slave])


@pytest.mark.parametrize("seed", range(10))
def test_perfect_touches_give_the_true_transform_wherever_the_slave_stands(seed):
    cell = random_cell(np.random.default_rng(seed))
    solution = solve(noiseless(cell, wide_plan(), Faults()), STAGE)
    np.testing.assert_allclose(solution.state.slave, cell.slave, atol=1e-9)
    assert solution.null.shape[1] == 0


def test_corrections_come_back_where_nothing_holds_them():
    stage = replace(STAGE, prior_std=np.full(8, 1.0))
    wrong = Faults(1e-3, 0.1e-3, 1e-4, 2e-4, 1e-3, 3e-4, 2e-4, 0.3e-3)
    found = solve(noiseless(TILTED_CELL, wide_plan(), wrong), stage).state
    np.testing.assert_allclose(found.slave, TILTED_CELL.slave, atol=1e-6)
    expected = [1e-3, 0.1e-3, 1e-4, 2e-4, 1e-3, 3e-4, 2e-4, 0.3e-3]
    np.testing.assert_allclose(found.corrections, expected, atol=2e-6)


SOUND_RUNS = 80


@pytest.fixture(scope="module")
def sound_stages():
    """Registrations of sound stages: corrections within their priors, as a user would run them."""
    found = []
    for run in range(SOUND_RUNS):
        rng = np.random.default_rng((3, run))
        faults = Faults(**within_prior(STAGE.prior_std, rng))
        found.append(examine(simulate(TILTED_CELL, wide_plan(), faults, rng), STAGE))
    return found


def test_intervals_hold_the_truth_in_95_of_100_runs(sound_stages):
    """80 runs of six components; their mean is sure to about 1.3 %. All 1,000: stage_study."""
    inside, true = 0.0, TILTED_CELL.slave
    for entry in sound_stages:
        found = entry.solution.state.slave
        turn = Rotation.from_matrix(true[:3, :3] @ found[:3, :3].T).as_rotvec()
        away = np.concatenate([true[:3, 3] - found[:3, 3], turn])
        inside += np.mean(np.abs(away) <= 1.959964 * standard_deviations(entry.solution))
    assert 0.91 < inside / SOUND_RUNS < 0.985


def test_a_sound_stage_is_not_blamed(sound_stages):
    """About one in a hundred is; five in eighty would be one chance in 500."""
    assert sum(bool(entry.faults) for entry in sound_stages) < 5


def test_monte_carlo_agrees_with_the_law_of_propagation():
    touches = simulate(TILTED_CELL, wide_plan(), Faults(), np.random.default_rng(1))
    solution = solve(touches, STAGE)
    draws = draw_registrations(solution, touches, STAGE, draws=1000, seed=2)
    # 1,000 draws know a standard deviation to 2.2 %.
    np.testing.assert_allclose(draws.std, standard_deviations(solution), rtol=0.09)
    np.testing.assert_allclose(draws.half_width / draws.std, 1.96, rtol=0.1)


def test_monte_carlo_s_common_solution_is_the_solution_of_each_draw():
    touches = simulate(TILTED_CELL, wide_plan(), Faults(), np.random.default_rng(1))
    loud = replace(STAGE, sigma_slide=1e-3, sigma_angle=2e-3, prior_std=np.zeros(8), sigma_rod=1e-3)
    solution = solve(touches, loud)
    moves = draw_registrations(solution, touches, loud, draws=3, seed=5).moves
    again = draw_registrations(solution, touches, loud, draws=3, seed=5).moves
    np.testing.assert_array_equal(moves, again)
    assert np.abs(moves).max() > 1e-4


def test_two_slave_touches_leave_the_turn_about_their_line_and_say_what_fixes_it():
    touches = noiseless(LEVEL_CELL, short_plan(), Faults())
    result = register(touches, replace(STAGE, level_in_master=True))
    (left,) = result.undetermined
    assert "turn of the slave's base about the line R1R2" in left.words
    assert "touch by the slave" in left.fixed_by
    assert np.isinf(result.std[3:]).any()
    turned = touches.tips[2:] @ LEVEL_CELL.slave[:3, :3].T + LEVEL_CELL.slave[:3, 3]
    axis = (turned[1] - turned[0]) / np.linalg.norm(turned[1] - turned[0])
    assert abs(left.twist[3:] @ axis) / np.linalg.norm(left.twist[3:]) > 1 - 1e-9


def test_the_touch_that_is_named_closes_the_open_direction():
    rows = [
        (0, 1, 0.0, 0.0, 0.5),
        (0, 0, 0.0, 0.0, 0.0),
        (1, 1, 1.5, 0.6, 0.6),
        (1, 1, 1.5, -0.4, 0.8),
        (1, 0, 1.5, 0.0, 0.0),
    ]
    level = replace(STAGE, level_in_master=True)
    two = register(noiseless(LEVEL_CELL, Plan.of(rows[:4]), Faults()), level)
    assert two.undetermined[0].fixed_by == "a touch by the slave of the slide cup at slide 1500 mm"
    three = register(noiseless(LEVEL_CELL, Plan.of(rows), Faults()), level)
    assert not three.undetermined
    assert np.isfinite(three.std).all()


def test_without_levels_the_master_s_line_is_open_too():
    result = register(noiseless(LEVEL_CELL, short_plan(), Faults()), STAGE)
    words = " / ".join(entry.words for entry in result.undetermined)
    assert len(result.undetermined) == 2
    assert "R1R2" in words
    assert "P1P2" in words


@pytest.mark.parametrize("seed", range(8))
def test_the_master_s_line_stays_open_whatever_noise_further_slave_touches_bring(seed):
    """Misclosures must not pass for knowledge of the turn that no touch tells."""
    rows = [(0, 1, 0.0, 0.0, 0.35), (0, 0, 0.0, 0.0, 0.0)]
    # The third place lies a fraction of a millimetre off the line of the two before it.
    rows += [(1, 1, 1.5, -0.52, 0.25), (1, 1, 1.5, 0.52, 0.45), (1, 1, 1.499, -0.26, 0.2517)]
    touches = simulate(TILTED_CELL, Plan.of(rows), Faults(), np.random.default_rng(seed))
    result = register(touches, STAGE)
    named = [entry.words.split(" through")[0] for entry in result.undetermined]
    assert named == ["turn of the slave's base about the line P1P2"]
    assert not result.next_touch.by_slave


def test_four_touches_are_enough_where_both_bases_are_level():
    result = register(noiseless(LEVEL_CELL, short_plan(), Faults()), LEVEL)
    assert not result.undetermined
    np.testing.assert_allclose(result.transform, LEVEL_CELL.slave, atol=1e-9)


def test_one_touch_by_the_slave_is_no_answer():
    touches = noiseless(LEVEL_CELL, short_plan(), Faults())
    with pytest.raises(NoAnswer, match="1 touches by the slave"):
        register(touches.only(np.array([True, True, True, False])), LEVEL)


def correction(result, name):
    return next(entry for entry in result.corrections if entry.name == name)


def one_slide_position_each() -> list[tuple]:
    return [
        (slave, cup, slide, angle, length)
        for slave, slide in ((0, 0.0), (1, 1.5))
        for cup, angle, length in ((0, 0, 0), (1, 0.0, 0.4), (1, 0.8, 0.8), (1, -0.8, 0.6))
    ]


END_FOR_END = frame([0.7, -0.7, 0.4], [0, 0, np.pi - 1.5])
UPSIDE_DOWN = np.diag([1.0, -1.0, -1.0, 1.0])


@pytest.mark.parametrize(
    ("fault", "size", "moved"), [("angle_zero", 2e-3, 3.0e-3), ("squareness", 1e-3, 1.5e-3)]
)
def test_a_fault_across_the_guide_is_hidden_with_one_slide_position_each(fault, size, moved):
    """Over 1.5 m the base is off by 1.5 m times the angle, and no residual tells."""
    touches = noiseless(LEVEL_CELL, Plan.of(one_slide_position_each()), Faults(**{fault: size}))
    result = register(touches, STAGE)
    assert not result.faults
    assert correction(result, fault).hidden
    assert correction(result, fault).base_shift == pytest.approx(moved, rel=0.02)
    away = np.linalg.norm((result.transform - LEVEL_CELL.slave)[:3, 3])
    assert away == pytest.approx(moved, rel=0.02)


@pytest.mark.parametrize(
    ("fault", "size", "second", "shown"),
    [
        ("squareness", 1e-3, END_FOR_END, True),
        ("angle_zero", 2e-3, LEVEL_CELL.stages[0] @ UPSIDE_DOWN, True),
        ("angle_zero", 2e-3, END_FOR_END, False),
    ],
    ids=["squareness, end for end", "angle zero, upside down", "angle zero, end for end"],
)
def test_a_second_placement_reveals_what_it_reverses(fault, size, second, shown):
    """End for end the travel and the way across both change sign: only what turns about the
    rod's axis stays as it was."""
    swapped = second is END_FOR_END
    rows = one_slide_position_each()
    again = [((1 - row[0]) if swapped else row[0], *row[1:]) for row in rows]
    plan = Plan.of([(*row, 0) for row in rows] + [(*row, 1) for row in again])
    cell = Cell([LEVEL_CELL.stages[0], second], LEVEL_CELL.slave)
    result = register(noiseless(cell, plan, Faults(**{fault: size})), STAGE)
    away = np.linalg.norm((result.transform - LEVEL_CELL.slave)[:3, 3])
    assert correction(result, fault).hidden != shown
    assert [entry.fault for entry in result.faults] == ([fault] if shown else [])
    assert (away < 0.1e-3) == shown


def test_the_slide_s_zero_is_no_matter():
    touches = noiseless(TILTED_CELL, wide_plan(), Faults())
    readings = replace(touches.readings, slide=touches.readings.slide + 0.123)
    moved = solve(replace(touches, readings=readings), replace(STAGE, prior_std=np.zeros(8)))
    np.testing.assert_allclose(moved.state.slave, TILTED_CELL.slave, atol=1e-9)


def test_the_proposed_touch_lowers_the_uncertainty_by_what_was_predicted():
    rng = np.random.default_rng(4)
    plan = Plan.of([
        (0, 1, 0.0, 0.0, 0.5), (0, 0, 0.0, 0, 0), (0, 1, 0.4, 0.7, 0.8),
        (1, 1, 1.5, 0.6, 0.6), (1, 1, 1.5, -0.4, 0.8), (1, 0, 1.7, 0, 0),
    ])  # fmt: skip
    touches = simulate(TILTED_CELL, plan, Faults(), rng)
    solution = solve(touches, STAGE)
    touch = best_next_touch(solution, touches, STAGE, Travel())
    extended = Plan(
        np.append(plan.by_slave, touch.by_slave),
        np.append(plan.on_rod, touch.on_rod),
        np.append(plan.slide, touch.slide),
        np.append(plan.angle, touch.angle),
        np.append(plan.length, touch.length),
        np.append(plan.placement, 0),
    )
    after = solve(simulate(TILTED_CELL, extended, Faults(), rng), STAGE)
    reach = np.linalg.norm(touches.tips[touches.by_slave], axis=1).max()
    variances = standard_deviations(after) ** 2
    found = np.sqrt(variances[:3].sum() + 2 / 3 * reach**2 * variances[3:].sum())
    assert touch.after < 0.95 * touch.before
    assert found == pytest.approx(touch.after, rel=0.03)


def test_tips_that_move_together_make_the_transform_less_sure():
    touches = simulate(TILTED_CELL, wide_plan(), Faults(), np.random.default_rng(1))
    alone = standard_deviations(solve(touches, STAGE))
    slave = np.repeat(touches.by_slave, 3).astype(float)
    shift = np.tile([0.0, 0.0, 0.2e-3], len(touches)) * slave
    common = replace(touches, tip_covariance=touches.tip_covariance + np.outer(shift, shift))
    together = standard_deviations(solve(common, STAGE))
    grown = np.sqrt((together[:3] ** 2 - alone[:3] ** 2).sum())
    assert grown == pytest.approx(0.2e-3, rel=0.02)
