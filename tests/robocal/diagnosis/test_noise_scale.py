"""How much noise a cause is judged by."""

import pytest
from scipy.stats import chi2

from robocal.diagnosis.evidence import noise_scale

NU = 380.0


def test_an_effect_that_just_shows_is_judged_by_the_declared_noise():
    """A Lambda of 5.5 adds 30 to the sum of squares."""
    assert noise_scale(NU + 5.5**2, NU) == 1.0
    assert noise_scale(0.5 * NU, NU) == 1.0


def test_noise_that_the_residuals_surely_contradict_is_taken_for_what_they_show():
    surely, hardly = chi2.ppf(0.995, NU), chi2.ppf(0.98, NU)
    assert noise_scale(hardly, NU) == 1.0
    assert noise_scale(surely, NU) == pytest.approx((surely / NU) ** 0.5)
    assert noise_scale(1.5**2 * NU, NU) == pytest.approx(1.5)


def test_without_a_degree_of_freedom_it_is_as_declared():
    assert noise_scale(1e-9, 0.0) == 1.0
