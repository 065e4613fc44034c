"""The best test whatever, where the answer is known."""

import numpy as np
import pytest
from scipy.stats import norm

from tests.blind.trials import ROBOTS
from tests.studies.detection_bound import Place, detected, place

NORMAL_97 = 1.8808
"""Quantile that leaves 3 % of clean campaigns above."""


def place_of(shift: float, strength: float) -> Place:
    """Forty effects alike, of which a part shows."""
    shifts = np.tile(shift * np.eye(12)[0], (40, 1))
    alike = np.full(40, "backlash 1")
    return Place(np.full(40, strength), shifts, alike, np.ones(40, dtype=bool))


def test_of_one_known_effect_it_is_the_test_of_a_normal_mean():
    shares = detected(place_of(5.0, strength=5.0), 5.0, seed=1)
    assert shares == pytest.approx(2 * [norm.cdf(5.0 - NORMAL_97)], abs=0.01)
    fainter = detected(place_of(2.5, strength=5.0), 5.0, seed=1)
    assert fainter == pytest.approx(2 * [norm.cdf(2.5 - NORMAL_97)], abs=0.04)


def test_a_geometry_of_known_spread_hides_no_more_than_one_that_may_be_anything():
    at = place(ROBOTS[0], seed=3, index=0, effects=60)
    left = np.linalg.norm(at.shift, axis=1) / at.strength
    assert (left > 1.0 - 1e-6).all()
    assert (left < 1.5).all()
