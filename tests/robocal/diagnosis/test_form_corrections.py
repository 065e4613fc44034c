"""What the remainder of an effect may look like, and what is a cause of its own."""

import pytest

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.effect import Follows, Instance
from robocal.diagnosis.form_corrections import may_mend


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
