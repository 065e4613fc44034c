"""What a prismatic joint is off by is a length, and its name says so."""

from dataclasses import replace

import numpy as np
import pytest
import yaml

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.extended import FittedEffect, moves_of
from robocal.formats.effects_yaml import effect_document, read_effect
from robocal.formats.fields import read_fields
from tests.robocal.diagnosis.test_effects import arm_and_rows, seen

SLIDING = 6
NAMES = {
    "encoder_step": ("step_rad", "step_m"),
    "backlash": ("width_rad", "width_m"),
    "joint_thermal_drift": ("drift_rad_per_k", "drift_m_per_k"),
    "joint_coupling": ("coupling", "coupling_m_per_rad"),
}


@pytest.fixture(scope="module")
def sliding() -> Circumstances:
    """Rows of an arm whose last joint slides."""
    rows = seen(*arm_and_rows())
    prismatic = np.arange(1, rows.n_joints + 1) == SLIDING
    geometry = replace(rows.robot.geometry, prismatic=prismatic)
    return replace(rows, robot=replace(rows.robot, geometry=geometry))


def instance(effect: str, joint: int, rows: Circumstances) -> Instance:
    return next(each for each in EFFECTS[effect].instances(rows) if each.joint == joint)


@pytest.mark.parametrize("effect", NAMES)
def test_the_unit_in_a_coefficients_name_is_the_joints_own(effect, sliding):
    turning, slid = (instance(effect, joint, sliding) for joint in (SLIDING - 1, SLIDING))
    assert (turning.coefficients[0].name, slid.coefficients[0].name) == NAMES[effect]
    np.testing.assert_array_equal(turning.prior_std, slid.prior_std)


def test_a_turning_joint_driven_by_a_sliding_one_turns_by_so_much_a_metre(sliding):
    geometry = replace(sliding.robot.geometry, prismatic=np.arange(6) == 4)
    rows = replace(sliding, robot=replace(sliding.robot, geometry=geometry))
    (last,) = (
        each
        for each in EFFECTS["joint_coupling"].instances(rows)
        if (each.joint, each.argument("driven_by")) == (6, 5.0)
    )
    assert last.coefficients[0].name == "coupling_rad_per_m"


@pytest.mark.parametrize("effect", NAMES)
def test_a_model_with_the_names_of_before_is_read_and_moves_the_joint_alike(
    effect, sliding, tmp_path
):
    fitted = FittedEffect(instance(effect, SLIDING, sliding), np.array([3e-4]), np.eye(1) * 1e-10)
    before, now = NAMES[effect]
    path = tmp_path / "effect.yaml"
    path.write_text(yaml.safe_dump(effect_document(fitted)).replace(f"{now}:", f"{before}:"))
    read = read_effect(read_fields(path))
    assert read.instance.coefficients[0].name == before
    for parameter, moved in moves_of(sliding, (fitted,)).items():
        np.testing.assert_array_equal(moves_of(sliding, (read,))[parameter], moved)
