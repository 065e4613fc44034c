"""Rates and the law of detection, against published numbers and a law that is known."""

import math

import numpy as np
import pytest

from tests.blind.intervals import Rate, logistic, mean, rate, strength_at


@pytest.mark.parametrize(
    ("hits", "of", "low", "high"),
    [
        # Newcombe, Statistics in Medicine 17 (1998) 857, table I, method 3.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_the_interval_is_wilsons(hits, of, low, high):
    assert Rate(hits, of).interval == pytest.approx((low, high), abs=1e-4)


def test_nothing_of_nothing_is_unknown():
    assert math.isnan(rate([]).value)
    assert rate([]).interval == (0.0, 1.0)


def test_a_mean_lies_in_the_middle_of_its_interval():
    estimate = mean([1.0, 2.0, 3.0])
    assert estimate.value == 2.0
    assert estimate.interval == pytest.approx((2 - 1.96 / 3**0.5, 2 + 1.96 / 3**0.5), abs=1e-3)


def test_the_logistic_fit_solves_its_likelihood_equations():
    x = np.array([0.0, 1.0, 1.0, 2.0, 3.0, 3.0, 4.0])
    hit = np.array([0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0])
    a, b = logistic(x, hit)
    left = hit - 1 / (1 + np.exp(-(a + b * x)))
    np.testing.assert_allclose([left.sum(), (left * x).sum()], 0, atol=0.01)


def test_the_law_of_detection_is_found_again():
    rng = np.random.default_rng(3)
    x = rng.uniform(0, 10, 2000)
    # Log odds 2 (x - 4): 95 % at 4 + log(19) / 2.
    hit = rng.random(2000) < 1 / (1 + np.exp(-2 * (x - 4)))
    found = strength_at(list(x), list(hit))
    truth = 4 + math.log(19) / 2
    assert found.interval[0] < truth < found.interval[1]
    assert found.value == pytest.approx(truth, abs=0.3)


def test_there_is_no_law_where_everything_was_detected():
    assert math.isnan(strength_at([3.0, 5.0], [True, True]).value)
