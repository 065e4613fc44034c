"""The other forms of an effect of gravity or heat hold what physics leaves of a wrong one."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.effect import base_index, theta
from robocal.diagnosis.extended import FittedEffect
from robocal.diagnosis.open_forms import other_forms
from tests.robocal.diagnosis.physics import moment, torque
from tests.robocal.diagnosis.test_effects import arm_and_rows, seen

COMPLIANCE = 2e-6
EXPANSION = 23e-6
LINK_2_A, LINK_4_D = 5 * 1 + 2, 5 * 3 + 1
"""Places of two lengths among five parameters a link."""
NOISE = 0.02
"""Of the remainder: what is smaller need not be taken up; [1]"""


@pytest.fixture(scope="module")
def cell():
    """The arm, its rows, and the same rows as robocal sees them."""
    arm, rows = arm_and_rows()
    return arm, rows, seen(arm, rows)


def fitted(name, around, joint):
    instances = EFFECTS[name].instances(around)
    (instance,) = [each for each in instances if each.joint == joint]
    return (FittedEffect(instance, np.array([COMPLIANCE]), np.zeros((1, 1))),)


def left_over(around, effect, parameter, remainder):
    """The share of a remainder that the other forms leave, and the largest one in deviations."""
    forms = [moves for moves in other_forms(around, effect) if parameter in moves]
    columns = np.concatenate([moves[parameter] for moves in forms], axis=1)
    noise = NOISE * np.sqrt(np.mean(remainder**2))
    n = columns.shape[1]
    weighed = np.concatenate([columns / noise, np.eye(n)])
    size, *_ = np.linalg.lstsq(weighed, np.append(remainder / noise, np.zeros(n)))
    left = np.linalg.norm(remainder - columns @ size) / np.linalg.norm(remainder)
    return left, np.abs(size).max()


def test_a_yielding_joint_with_other_masses_and_centres_than_stated(cell):
    arm, rows, around = cell
    load = rows.load
    other = replace(
        load,
        mass=load.mass * np.array([1.0, 1.08, 0.93, 1.1, 1.0, 0.9]),
        centre=load.centre * np.array([[1.0, 1.05, 1.06, 0.92, 1.0, 1.0]]).T,
    )
    turned = COMPLIANCE * torque(arm, replace(rows, load=other), 2)
    remainder = turned - COMPLIANCE * torque(arm, rows, 2)
    effect = fitted("joint_compliance", around, 2)
    left, deviations = left_over(around, effect, theta(2, around), remainder)
    # What is left is the product of both deviations, a tenth of a tenth.
    assert left < 0.05
    assert deviations < 2.0


def test_a_joint_that_grows_stiffer_under_load(cell):
    arm, rows, around = cell
    tau = torque(arm, rows, 2)
    h = np.abs(tau).max()
    remainder = COMPLIANCE * (h * np.tanh(tau / h) - tau)
    effect = fitted("joint_compliance", around, 2)
    left, deviations = left_over(around, effect, theta(2, around), remainder)
    assert left < 0.1
    assert deviations < 2.0


def test_a_pedestal_that_is_stiffer_one_way(cell):
    arm, rows, around = cell
    about_y = moment(arm, rows, 0, np.zeros(3))[:, 1]
    remainder = -0.35 * COMPLIANCE * about_y
    effect = fitted("base_compliance", around, None)
    left, deviations = left_over(around, effect, base_index(around) + 4, remainder)
    assert left < 0.01
    assert deviations < 1.0


def test_masses_that_nobody_states_leave_no_form_of_theirs_open(cell):
    _, _, around = cell
    bare = replace(around, payload=np.zeros(len(around)))
    effect = fitted("joint_compliance", around, 2)
    of_masses = 4 * sum(link.mass > 0 for link in around.robot.masses)
    one_way_and_hardening = 2
    assert len(other_forms(around, effect)) - len(other_forms(bare, effect)) == 3
    assert len(other_forms(bare, effect)) == of_masses + one_way_and_hardening
    unstated = replace(around, robot=replace(around.robot, masses=None))
    assert other_forms(unstated, effect) == []


@pytest.mark.parametrize(("parameter", "share"), [(LINK_2_A, 0.4), (LINK_4_D, -0.3)])
def test_a_link_that_grows_otherwise_than_the_rest(cell, parameter, share):
    arm, rows, around = cell
    (expansion,) = EFFECTS["thermal_expansion"].instances(around)
    effect = (FittedEffect(expansion, np.array([EXPANSION]), np.zeros((1, 1))),)
    length = arm.links[parameter // 5][parameter % 5]
    remainder = share * EXPANSION * (rows.temperature - rows.temperature.mean()) * length
    left, deviations = left_over(around, effect, parameter, remainder)
    assert left < 0.01
    assert deviations < 1.0


def test_what_neither_load_nor_heat_drives_has_no_form_that_is_known(cell):
    assert other_forms(cell[-1], fitted("backlash", cell[-1], 2)) == []
