"""The best namer whatever, where the answer is known."""

import numpy as np
import pytest
from scipy.stats import norm

from tests.studies.drawn_effects import Place
from tests.studies.naming_bound import named

N = 40


def place_of(first: np.ndarray, second: np.ndarray) -> Place:
    """Two effects, as likely, of one size each."""
    shift = np.repeat([first, second], N, axis=0)
    name = np.repeat(["backlash 1", "settling 1"], N)
    return Place(np.linalg.norm(shift, axis=1), shift, name, np.ones(2 * N, dtype=bool))


def test_two_effects_are_told_apart_by_how_far_apart_they_are():
    large = 30.0 * np.eye(12)[0]
    apart = 2.0 * np.eye(12)[1]
    shares = named(place_of(large, large + apart), seed=1)
    assert shares == pytest.approx(2 * [norm.cdf(1.0)], abs=0.015)


def test_what_looks_alike_is_a_coin():
    large = 30.0 * np.eye(12)[0]
    assert named(place_of(large, large), seed=1) == pytest.approx([0.5, 0.5], abs=0.03)


def test_what_the_reading_of_the_temperature_tells_is_no_coin():
    large = 30.0 * np.eye(12)[0]
    at = place_of(large, large)
    told = Place(at.strength, at.shift, at.name, np.arange(2 * N) < N)
    assert named(told, seed=1) == (1.0, 1.0)


def test_an_alarm_that_wants_a_clear_name_detects_less_that_is_named_wrongly():
    small, larger = 2.0 * np.eye(12)[0], 2.0 * np.eye(12)[:2].sum(axis=0)
    at = place_of(small, larger)
    (any_name, _), (clear, _) = (named(at, seed=1, clearness=weight) for weight in (0.0, 7.0))
    assert clear > any_name + 0.02
