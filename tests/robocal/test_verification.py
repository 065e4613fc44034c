"""The plan of a verification: targets that both ways reach, or a clear end of the search."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.extended import FittedEffect
from robocal.errors import BadInput, NoAnswer
from robocal.verification import plan_verification
from tests.robocal.formats.calibrated_arms import calibrated_arm, largest_difference


@pytest.mark.parametrize("name", ["ur10e", "abb_irb910sc", "kuka_iiwa14"])
def test_the_true_robot_with_compensated_joints_is_where_the_nominal_one_would_be(name):
    arm = calibrated_arm(name)
    plan = plan_verification(arm.calibrated, 20, seed=3)
    assert plan.q_nominal.shape == plan.q_compensated.shape == (20, len(arm.nominal.links))
    wanted = arm.nominal.poses(plan.q_nominal)[:, :3, 3]
    assert largest_difference(wanted, arm.true.poses(plan.q_compensated)[:, :3, 3]) < 1e-6
    assert largest_difference(wanted, arm.true.poses(plan.q_nominal)[:, :3, 3]) > 1e-4


def with_effect(calibrated, name: str, joint: int | None, unit: str, value: float):
    """The same robot with an effect in its model."""
    instance = Instance(name, joint, (), (Coefficient(unit, 1e-3),))
    return replace(calibrated, effects=(FittedEffect(instance, np.array([value]), np.eye(1)),))


def test_a_model_with_an_effect_is_verified_with_the_effect_acting():
    arm = calibrated_arm("ur10e")
    gain = 4e-4
    plan = plan_verification(with_effect(arm.calibrated, "encoder_gain", 2, "gain", gain), 20, 3)
    wanted = arm.nominal.poses(plan.q_nominal)[:, :3, 3]
    reading = plan.q_compensated.copy()
    reading[:, 1] *= 1 + gain
    assert largest_difference(wanted, arm.true.poses(reading)[:, :3, 3]) < 1e-6
    assert largest_difference(wanted, arm.true.poses(plan.q_compensated)[:, :3, 3]) > 1e-4


def test_a_model_that_depends_on_the_temperature_is_not_verified_without_one():
    arm = calibrated_arm("ur10e")
    warm = with_effect(arm.calibrated, "joint_thermal_drift", 2, "zero_rad_per_k", 1e-5)
    with pytest.raises(BadInput, match=r"line \d+: lacks temperature_degc, which"):
        plan_verification(warm, 5, 3)
    assert len(plan_verification(warm, 5, 3, temperature=25.0).q_nominal) == 5


def test_a_robot_that_reaches_nothing_ends_the_search_with_a_sentence():
    arm = calibrated_arm("ur10e")
    # Links a third as long as stated: no target that the nominal robot takes is within reach.
    links = arm.calibrated.model.links * np.array([1.0, 1 / 3, 1 / 3, 1.0, 1.0])
    lost = replace(arm.calibrated, model=replace(arm.calibrated.model, links=links))
    with pytest.raises(NoAnswer, match=r"of 100 random targets only \d can be reached"):
        plan_verification(lost, 2, seed=3)
