"""Effects along several axes may be small as well as large."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.evidence import log_sum_exp
from robocal.diagnosis.group import Group, listed
from robocal.diagnosis.load_size import joint_compliance_of
from robocal.diagnosis.screen import of_all_sizes


def group_of(shift, *, axes=3):
    """A candidate with a prior of one, whose data tell each axis to 0.025."""
    information = np.eye(axes) / 0.025**2
    coefficients = tuple(Coefficient(f"axis_{axis}_m", 1.0) for axis in range(axes))
    own = Instance("base_drift", None, (), coefficients)
    found = np.zeros(axes)
    found[0] = shift
    score = (information @ found)[None, None]
    return Group(
        "base_drift", None, listed([own]), np.ones((1, axes)), np.zeros(1), information[None], score
    )


def evidence(group):
    return log_sum_exp(group.weighted[:, 0])


def test_a_small_shift_along_three_axes_is_seen_more_readily():
    plain = group_of(0.12)
    assert evidence(of_all_sizes(plain)) > evidence(plain) + 1.0


def test_a_large_one_costs_no_more_than_the_number_of_sizes():
    plain = group_of(1.5)
    assert evidence(of_all_sizes(plain)) > evidence(plain) - np.log(3.0)


def test_every_size_is_a_candidate_of_its_own_for_the_same_cause():
    grown = of_all_sizes(group_of(0.12))
    priors = [grown.candidate(k).prior_std[0] for k in range(3)]
    assert priors == pytest.approx([0.25, 0.5, 1.0])
    assert len({grown.candidate(k) for k in range(3)}) == 1
    np.testing.assert_allclose(np.exp(grown.log_prior).sum(), 1.0)


def test_a_step_that_is_searched_may_be_small_too():
    steps = replace(group_of(0.12), effect="base_step")
    assert evidence(of_all_sizes(steps)) == evidence(of_all_sizes(group_of(0.12)))


def test_an_effect_with_one_coefficient_keeps_its_size():
    plain = group_of(0.12, axes=1)
    assert of_all_sizes(plain) is plain


def test_a_joint_that_holds_a_ninth_is_thought_to_turn_by_a_third():
    loads = np.array([[-90.0, 20.0, 60.0], [3.0, -10.0, 1.0]])
    assert joint_compliance_of(1.5e-3, loads, 1) * 90.0 == pytest.approx(1.5e-3)
    assert joint_compliance_of(1.5e-3, loads, 2) * 10.0 == pytest.approx(0.5e-3)
