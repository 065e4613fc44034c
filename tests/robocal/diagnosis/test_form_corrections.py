"""What the remainder of an effect may look like, and what is a cause of its own."""

import numpy as np
import pytest

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.effect import Follows, Instance
from robocal.diagnosis.form_corrections import may_mend, places_of


def instance(effect, joint=None):
    return Instance(effect, joint, (), ())


def test_every_effect_says_what_it_follows():
    assert all(isinstance(effect.follows, Follows) for effect in EFFECTS.values())


@pytest.mark.parametrize(
    ("main", "small"),
    [
        ("joint_compliance", "gear_harmonic"),
        ("joint_compliance", "load_backlash"),
        ("base_compliance", "payload_compliance"),
        ("encoder_gain", "gear_harmonic"),
        ("backlash", "encoder_gain"),
        ("warm_up", "warm_up"),
        ("base_step", "base_step"),
    ],
)
def test_a_wrong_form_leaves_what_follows_the_same(main, small):
    assert may_mend(instance(main), instance(small))


@pytest.mark.parametrize(
    ("main", "small"),
    [
        ("joint_compliance", "settling"),
        ("encoder_gain", "backlash"),
        ("joint_coupling", "load_backlash"),
        ("joint_compliance", "thermal_expansion"),
        ("thermal_expansion", "joint_compliance"),
        ("base_step", "base_drift"),
        ("base_drift", "base_step"),
        ("base_step", "tool_step"),
    ],
)
def test_what_follows_something_else_is_a_cause_of_its_own(main, small):
    assert not may_mend(instance(main), instance(small))


def test_forms_of_one_place_stand_together_the_strongest_first():
    """Each of two forms is weak beside the other; only together do they show what acts there."""
    forms = [("load_backlash", 3, 0.0), ("joint_compliance", 2, 0.0), ("load_backlash", 3, 8.0)]
    instances = tuple(
        Instance(name, joint, (("taken_up_nm", load),), ()) for name, joint, load in forms
    )
    assert places_of(instances, np.array([3.0, 40.0, 5.0])) == [[1], [2, 0]]
