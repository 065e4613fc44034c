"""The Monte Carlo method on the examples of JCGM 101, section 9, and its rules one by one."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from robocal.uncertainty.agreement import compare
from robocal.uncertainty.coverage import (
    numerical_tolerance,
    shortest_interval,
    symmetric_interval,
)
from robocal.uncertainty.distributions import (
    ArcSine,
    CurvilinearTrapezoid,
    Normal,
    Rectangular,
    ScaledT,
)
from robocal.uncertainty.monte_carlo import (
    Stopping,
    block_generator,
    draws_of,
    sample,
    sample_adaptively,
)
from robocal.uncertainty.propagation import propagate, propagate_second_order

PRINTED = yaml.safe_load(
    (Path(__file__).parents[2] / "reference" / "jcgm_101_examples.yaml").read_text()
)
ROOT3 = np.sqrt(3.0)


def total(x):
    return x.sum(axis=0)


def box(std: float) -> Rectangular:
    return Rectangular(-ROOT3 * std, ROOT3 * std)


ADDITIVE = {
    "normal": [Normal(0.0, 1.0)] * 4,
    "rectangular": [box(1.0)] * 4,
    "wide": [box(1.0)] * 3 + [box(10.0)],
}


@pytest.mark.parametrize("name", ADDITIVE)
def test_the_additive_model_spreads_as_printed(name):
    """9.2. The printed digits are met when the draws are stable to two digits."""
    printed = PRINTED["additive"][name]
    drawn = sample_adaptively(draws_of(total, ADDITIVE[name]), 1, Stopping(digits=2))
    law = propagate(total, ADDITIVE[name])
    digit = 0.05 if name == "wide" else 0.01
    assert law.std == pytest.approx(printed["u"], abs=digit)
    assert [-law.expanded(), law.expanded()] == pytest.approx(printed["gum"], abs=digit)
    ends = printed.get("exact") or printed["monte_carlo"]
    # Tolerance of the procedure on top of the printed digits (9.2.4 prints one decimal).
    tolerance = 0.05 + (0.5 if name == "wide" else 0.0)
    assert [drawn.symmetric.low[0], drawn.symmetric.high[0]] == pytest.approx(ends, abs=tolerance)
    # The shortest one is as long, but its place wanders: the minimum is flat.
    length = drawn.shortest.high[0] - drawn.shortest.low[0]
    assert length == pytest.approx(ends[1] - ends[0], abs=2 * tolerance)
    assert drawn.shortest.high[0] == pytest.approx(ends[1], abs=3 * tolerance)
    assert drawn.stable


def test_four_boxes_have_the_exact_interval_of_their_convolution():
    """9.2.3.3: ± 2 sqrt(3) (2 - (3/5)^(1/4)); a million draws know it to 0.004."""
    exact = 2 * ROOT3 * (2 - 0.6**0.25)
    drawn = sample(draws_of(total, ADDITIVE["rectangular"]), 3, 1_000_000)
    assert drawn.symmetric.high[0] == pytest.approx(exact, abs=0.012)
    assert drawn.symmetric.low[0] == pytest.approx(-exact, abs=0.012)


def mass(x):
    """9.3, formula (24) [mg]."""
    reference, added, air, weight, standard = x
    return (reference + added) * (1 + (air - 1.2) * (1 / weight - 1 / standard)) - 100_000.0


MASS = [
    Normal(100_000.0, 0.050),
    Normal(1.234, 0.020),
    Rectangular(1.10, 1.30),
    Rectangular(7000.0, 9000.0),
    Rectangular(7950.0, 8050.0),
]


def test_the_mass_calibration_comes_out_as_printed_and_fails_the_validation():
    printed = PRINTED["mass"]
    first, second = propagate(mass, MASS), propagate_second_order(mass, MASS)
    for found, rows in ((first, "gum_first_order"), (second, "gum_second_order")):
        assert found.std == pytest.approx(printed[rows]["u"], abs=0.0001)
        ends = [found.estimate - found.expanded(), found.estimate + found.expanded()]
        assert ends == pytest.approx(printed[rows]["interval"], abs=0.0002)
    drawn = sample_adaptively(draws_of(mass, MASS), 1, Stopping(digits=2))
    assert drawn.mean[0] == pytest.approx(printed["monte_carlo"]["mean"], abs=0.0005)
    assert drawn.std[0] == pytest.approx(printed["monte_carlo"]["u"], abs=0.0005)
    ends = [drawn.shortest.low[0], drawn.shortest.high[0]]
    assert ends == pytest.approx(printed["monte_carlo"]["shortest"], abs=0.003)
    judged = compare(
        np.array([first.estimate]), np.array([first.std]), np.array([first.expanded()]),
        drawn.symmetric, digits=1,
    )  # fmt: skip
    # 9.3.2.6 prints distances of 0.0451 and 0.0430 against a tolerance of 0.005.
    assert judged.tolerance[0] == pytest.approx(0.005)
    assert judged.low[0] == pytest.approx(0.0445, abs=0.002)
    assert not judged.validated[0]


def loss(x):
    return x[0] ** 2 + x[1] ** 2


@pytest.mark.parametrize(
    "printed", PRINTED["loss"], ids=lambda row: f"x1={row['x1']}, r={row['r']}"
)
def test_the_comparison_loss_comes_out_as_printed(printed):
    """9.4; exact moments stand beside the printed ones, whose last digit is a draw's."""
    u, r = 0.005, printed["r"]
    inputs = [Normal(printed["x1"], u), Normal(0.0, u)]
    correlation = np.array([[1.0, r], [r, 1.0]])
    law = propagate(loss, inputs, correlation)
    assert law.std * 1e6 == pytest.approx(printed["gum_u"], abs=0.5)
    if r == 0.0:
        second = propagate_second_order(loss, inputs)
        assert second.std * 1e6 == pytest.approx(printed["second_order_u"], abs=0.5)
    drawn = sample(draws_of(loss, inputs, correlation), 2, 400_000)
    exact = np.sqrt(4 * u**2 * printed["x1"] ** 2 + 4 * u**4 * (1 + r**2))
    assert drawn.std[0] == pytest.approx(exact, rel=0.01)
    assert drawn.std[0] * 1e6 == pytest.approx(printed["u"], rel=0.02)
    assert drawn.mean[0] * 1e6 == pytest.approx(printed["mean"], rel=0.01)
    ends = [drawn.shortest.low[0] * 1e6, drawn.shortest.high[0] * 1e6]
    # The shortest interval is flat about its minimum, so its ends wander by some per cent of u.
    assert ends == pytest.approx(printed["shortest"], abs=0.1 * printed["u"])


def gauge(x):
    """9.5: deviation of the block from 50 mm [nm]."""
    standard, reading, random, systematic, alpha, mean, cycle, d_alpha, d_theta = x
    growth = standard * (d_alpha * (mean + cycle) + alpha * d_theta)
    return standard + reading + random + systematic - growth - 50e6


def test_the_gauge_block_comes_out_as_printed():
    inputs = [
        ScaledT(50_000_623.0, 25.0, 18.0),
        ScaledT(215.0, 6.0, 24.0),
        ScaledT(0.0, 4.0, 5.0),
        ScaledT(0.0, 7.0, 8.0),
        Rectangular(9.5e-6, 13.5e-6),
        Normal(-0.1, 0.2),
        ArcSine(-0.5, 0.5),
        CurvilinearTrapezoid(-1.0e-6, 1.0e-6, 0.1e-6, 50.0),
        CurvilinearTrapezoid(-0.050, 0.050, 0.025, 2.0),
    ]
    printed = PRINTED["gauge_block"]
    law = propagate(gauge, inputs)
    assert law.std == pytest.approx(printed["gum"]["u"], abs=0.6)
    ends = [law.estimate - law.expanded(0.99), law.estimate + law.expanded(0.99)]
    assert ends == pytest.approx(printed["gum"]["interval"], abs=1.5)
    drawn = sample(draws_of(gauge, inputs), 1, 1_000_000, coverage=0.99)
    assert drawn.mean[0] == pytest.approx(printed["monte_carlo"]["mean"], abs=0.5)
    assert drawn.std[0] == pytest.approx(printed["monte_carlo"]["u"], abs=0.5)
    ends = [drawn.shortest.low[0], drawn.shortest.high[0]]
    assert ends == pytest.approx(printed["monte_carlo"]["shortest"], abs=1.5)


@pytest.mark.parametrize(
    ("u", "digits", "tolerance"),
    [(0.35, 2, 0.005), (0.35, 1, 0.05), (3.2e-5, 2, 5e-7), (10.0, 2, 0.5), (0.0996, 2, 0.005)],
)
def test_the_numerical_tolerance_is_half_a_unit_of_the_last_digit(u, digits, tolerance):
    """7.9.2, examples 1 to 3; 0.0996 is 0.10 to two digits."""
    assert numerical_tolerance(np.array([u]), digits)[0] == pytest.approx(tolerance)


def test_intervals_of_a_skew_sample_are_those_of_the_exponential():
    """Symmetric: the quantiles of 2.5 and 97.5 %; shortest: from zero to that of 95 %."""
    values = np.random.default_rng(1).exponential(size=(1, 1_000_000))
    even, short = symmetric_interval(values, 0.95), shortest_interval(values, 0.95)
    assert even.low[0] == pytest.approx(-np.log(0.975), abs=0.002)
    assert even.high[0] == pytest.approx(-np.log(0.025), abs=0.02)
    assert short.low[0] == pytest.approx(0.0, abs=0.002)
    assert short.high[0] == pytest.approx(-np.log(0.05), abs=0.02)


def test_more_digits_take_more_draws_and_a_limit_is_reported():
    inputs = [Normal(0.0, 4.9)] * 4  # of u = 9.8 the second digit is half a per cent
    one = sample_adaptively(draws_of(total, inputs), 1, Stopping(digits=1))
    two = sample_adaptively(draws_of(total, inputs), 1, Stopping(digits=2))
    cut = sample_adaptively(draws_of(total, inputs), 1, Stopping(digits=2, most_blocks=6))
    assert one.n_draws < two.n_draws
    assert one.stable
    assert two.stable
    assert cut.n_draws == 60_000
    assert not cut.stable


def test_a_stable_sample_stays_within_its_tolerance_on_another_seed():
    """Both runs are within the tolerance of the truth, so within twice of each other."""
    inputs = ADDITIVE["rectangular"]
    one, other = (
        sample_adaptively(draws_of(total, inputs), seed, Stopping(digits=2)) for seed in (1, 2)
    )
    tolerance = numerical_tolerance(one.std, 2)[0]
    assert abs(one.symmetric.high[0] - other.symmetric.high[0]) < 2 * tolerance
    assert abs(one.std[0] - other.std[0]) < 2 * tolerance


def test_blocks_draw_the_same_wherever_they_are_computed():
    ahead = block_generator(4, 7).normal(size=5)
    for block in range(7):
        block_generator(4, block).normal(size=100)
    np.testing.assert_array_equal(block_generator(4, 7).normal(size=5), ahead)
    assert block_generator(4, 6).normal() != ahead[0]
