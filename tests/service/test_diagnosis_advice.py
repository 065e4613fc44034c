"""What is advised at the machine, and where a name or a sign forbids the usual advice."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.causes import Cause, Naming
from robocal.diagnosis.diagnosis import NamedEffect
from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.gain import Gain
from robocal.formats.robot_yaml import read_robot
from service.diagnosis_advice import advice_on
from tests.robocal.diagnosis.hidden_cases import STAUBLI, run_diagnose, write_cases

WITH_MASSES = read_robot(STAUBLI)
WITHOUT = replace(WITH_MASSES, masses=None)
GAIN = Gain(1e-4, 5e-5, (0.4, 0.6), 40)


def instance(effect: str, joint: int | None = None) -> Instance:
    return Instance(effect, joint, (), (Coefficient("size", 1.0),))


def named(own: Instance, value: float, naming: Naming) -> NamedEffect:
    """An effect of a size, in standard uncertainties."""
    fitted = FittedEffect(own, np.array([value]), np.eye(1))
    return NamedEffect(fitted, naming, 0.5, GAIN, GAIN)


def alone(effect: str, joint: int | None, value: float) -> NamedEffect:
    own = instance(effect, joint)
    return named(own, value, Naming((Cause(own, 1.0),), 0.0))


def test_noise_is_the_likelier_only_where_it_is_more_probable_than_every_cause():
    step, rival = instance("base_step"), instance("warm_up")
    improbable = named(step, 9.0, Naming((Cause(rival, 1.0),), 2e-13))
    doubtful = named(step, 2.0, Naming((Cause(step, 0.2), Cause(rival, 0.3)), 0.5))
    assert advice_on(improbable, WITHOUT) == (
        f"warm_up is the likelier here: {EFFECTS['warm_up'].advice}"
    )
    assert "noise alone is the likelier" in advice_on(doubtful, WITHOUT)


@pytest.mark.parametrize("effect", ["joint_compliance", "link_bending", "base_compliance"])
def test_a_spring_that_is_surely_negative_points_to_what_is_stated_of_the_robot(effect):
    joint = None if effect == "base_compliance" else 2
    told = advice_on(alone(effect, joint, -3.5), WITH_MASSES)
    assert "direction of gravity in campaign.yaml" in told
    assert "sign of payload_kg" in told
    for value, robot in ((-2.5, WITH_MASSES), (3.5, WITH_MASSES), (-3.5, WITHOUT)):
        assert advice_on(alone(effect, joint, value), robot) == EFFECTS[effect].advice


def test_a_negative_payload_compliance_points_to_the_payload_stated_in_the_controller():
    told = advice_on(alone("payload_compliance", 3, -4.0), WITHOUT)
    assert "the controller compensates more than there is" in told
    assert "check the payload stated there" in told


def test_gravity_that_points_upward_is_told_at_the_terminal_and_in_the_report(call, tmp_path):
    chosen = ("--kind", "one", "--effect", "joint_compliance", "--seed", "7", "--count", "1")
    bundle = write_cases(tmp_path / "cases", *chosen, "--size", "3") / "0000"
    campaign = bundle / "campaign.yaml"
    lines = campaign.read_text().splitlines()
    kept = [line for line in lines if not line.startswith("gravity")]
    campaign.write_text("\n".join([*kept, "gravity: [0, 0, 1]", ""]))
    printed = run_diagnose(call, bundle, tmp_path / "out")
    for told in (printed, (tmp_path / "out" / "report.html").read_text()):
        assert "no spring is negative: check the direction of gravity" in told
