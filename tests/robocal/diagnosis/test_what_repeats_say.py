"""Repeats of one pose tell noise that is stated too small from a model that lacks something."""

import numpy as np
import pytest


def test_repeats_that_scatter_more_than_declared_say_that_the_noise_is_stated_too_small(found):
    printed, noisy = found(3, times=3, noise=1.6)
    repeats = noisy["pure_error"]
    assert repeats["degrees_of_freedom"] == 2 * 45 * 3
    assert repeats["variance_over_declared"] == pytest.approx(1.6**2, rel=0.3)
    assert repeats["contradicts_declared"]
    assert repeats["lack_of_fit_p"] > 0.01
    assert "lack of fit against repeats (270 degrees of freedom)" in printed
    assert "repeats of one pose scatter by 1." in printed
    assert "nothing of the catalogue" not in printed


def test_a_geometry_that_lacks_something_does_not_fit_the_means_of_its_repeats(found):
    def bent(q):
        q = q.copy()
        q[:, 2] += 4e-4 * np.sin(q[:, 2])
        return q

    printed, lacking = found(3, times=3, moved=bent)
    assert lacking["effects"][0]["effect"] == "gear_harmonic"
    repeats = lacking["pure_error"]
    assert not repeats["contradicts_declared"]
    assert repeats["geometry_lack_of_fit_p"] < 1e-6
    assert repeats["lack_of_fit_p"] > 0.01
    assert "scatter" not in printed


def test_without_repeats_nothing_is_said_of_them(found):
    assert found(3)[1]["pure_error"] is None
