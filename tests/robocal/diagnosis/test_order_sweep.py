"""The fast sweep over gear orders against plain sums."""

import numpy as np

from robocal.diagnosis.order_sweep import fourier_sums, order_grid, prior_of


def test_the_fast_sums_are_the_plain_sums():
    rng = np.random.default_rng(1)
    angle = rng.uniform(-7.0, 9.0, 150)
    values = rng.normal(size=(150, 3))
    last = 700
    plain = np.exp(1j * np.outer(np.arange(last + 1), angle)) @ values
    np.testing.assert_allclose(fourier_sums(angle, values, last), plain, atol=1e-6)


def test_orders_are_whole_multiples_of_one_step_finer_than_the_resolution():
    reading = np.random.default_rng(2).uniform(-3.0, 3.0, 50)
    orders = order_grid(reading)
    step = orders[1] - orders[0]
    np.testing.assert_allclose(orders / step, np.round(orders / step), atol=1e-6)
    assert orders[0] >= 0.5
    assert orders[-1] <= 400.0
    assert step < 0.5 / (np.ptp(reading) / (2 * np.pi))


def test_orders_of_gears_that_are_sold_are_expected_more_than_others():
    orders = order_grid(np.random.default_rng(2).uniform(-3.0, 3.0, 50))
    prior = prior_of(orders)
    np.testing.assert_allclose(prior.sum(), 1.0)
    own, other = np.argmin(abs(orders - 200.0)), np.argmin(abs(orders - 190.0))
    assert prior[own] > 10.0 * prior[other]
    assert prior.min() > 0.4 / len(orders)


def test_a_grid_without_gears_that_are_sold_is_even():
    orders = np.arange(3.0, 40.0, 0.5)
    np.testing.assert_allclose(prior_of(orders), 1.0 / len(orders))
