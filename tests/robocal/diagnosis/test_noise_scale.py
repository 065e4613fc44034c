"""How much noise a cause is judged by."""

import pytest
from scipy.stats import chi2

from robocal.diagnosis.evidence import noise_scale

NU = 380.0


def test_an_effect_that_just_shows_is_judged_by_the_declared_noise():
    """A Lambda of 5.5 adds 30 to the sum of squares."""
    assert noise_scale(NU + 5.5**2, NU) == 1.0
    assert noise_scale(0.5 * NU, NU) == 1.0


@pytest.mark.parametrize("truly", [1.2, 2.0, 10.0])
def test_noise_stated_too_small_is_taken_for_what_it_surely_is(truly):
    least = truly * (NU / chi2.ppf(0.95, NU)) ** 0.5
    assert noise_scale(truly**2 * NU, NU) == pytest.approx(least)
    assert 0.94 * truly < least < truly


def test_with_many_rows_it_is_what_the_model_leaves():
    assert noise_scale(4.0 * 36_000, 36_000) == pytest.approx(2.0, rel=0.01)


def test_without_a_degree_of_freedom_it_is_as_declared():
    assert noise_scale(1e-9, 0.0) == 1.0
