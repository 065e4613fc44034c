"""Every effect of the catalogue moves the target as its physics says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances, circumstances
from robocal.diagnosis.effect import Coefficient, Effect, Instance
from robocal.diagnosis.extended import FittedEffect, predict
from robocal.formats.robot_yaml import read_robot
from robocal.measurements import MeasurementSet
from tests.elementary_kinematics import Arm, arm_from_document, frame
from tests.robocal.diagnosis.physics import (
    PHYSICS,
    STEP_ROW,
    TAKEN_UP,
    TAU,
    Load,
    Rows,
    bent,
    share_of_time,
)
from tests.test_house_rules import stems

ROBOT = Path(__file__).parents[2] / "blind" / "robots" / "staubli_tx60_with_masses.yaml"
N = 30
UNSEEN = {"instrument_scale", "warm_up"}
"""Not to be seen in any rows, and not where the arm's temperature is read."""
JOINTS = {"link_bending": 2, "joint_coupling": 6}
MOMENT = (("line", 2.0 + STEP_ROW), ("last_line_before", 1.0 + STEP_ROW))
ARGUMENTS = {
    "gear_harmonic": (("order", 7.0),),
    "joint_coupling": (("driven_by", 5.0),),
    "warm_up": (("tau_s", TAU),),
    "load_backlash": (("taken_up_nm", TAKEN_UP),),
    "base_step": MOMENT,
    "tool_step": MOMENT,
    "encoder_step": MOMENT,
}
WITHOUT_JOINT = {
    "base_compliance",
    "thermal_expansion",
    "warm_up",
    "base_drift",
    "base_step",
    "tool_step",
    "instrument_scale",
    "instrument_angle",
}


def arm_and_rows() -> tuple[Arm, Rows]:
    """A loaded arm somewhere in front of an instrument, and thirty rows."""
    document = yaml.safe_load(ROBOT.read_text())
    rng = np.random.default_rng(3)
    base = frame([2.0, -1.0, 0.3, 0.7, 0.1, -0.2])
    arm = arm_from_document(document).within(base, frame([0.05, -0.04, 0.12, 0.3, 0.2, 0.1]))
    q = arm.draw(rng, N, 2.0)
    load = Load(
        np.array([link["mass_kg"] for link in document["links"]]),
        np.array([link["com_mm"] for link in document["links"]]) / 1e3,
        rng.choice([0.0, 2.0, 4.0], N),
        np.array([0.0, 0.0, -1.0]),
    )
    return arm, Rows(
        q,
        np.concatenate([q[:1], q[:-1]]),
        rng.choice([-1.0, 1.0], (N, 6)),
        np.sort(rng.uniform(0.0, 900.0, N)),
        rng.uniform(20.0, 35.0, N),
        rng.uniform(0.2, 1.0, N),
        load,
    )


def seen(arm: Arm, rows: Rows) -> Circumstances:
    """The same rows as robocal sees them."""
    nothing = np.full(N, np.nan)
    position = arm.poses(rows.q)[:, :3, 3]
    measured = MeasurementSet(
        lines=np.arange(2, N + 2),
        joints=rows.q,
        position=position,
        orientation=np.full((N, 4), np.nan),
        distance=nothing,
        pose=np.arange(N),
        target=("",) * N,
        held_out=np.zeros(N, dtype=bool),
        time=rows.time,
        temperature=rows.temperature,
        payload=rows.load.payload,
        speed=rows.speed,
        settle=nothing,
        approach=rows.approach,
        commanded=np.full((N, 6), np.nan),
    )
    robot = read_robot(ROBOT)
    return circumstances(robot, rows.load.down, arm.tool[:3, 3], arm.base[:3, :3], measured)


def instance_of(name: str, around: Circumstances) -> Instance:
    """The effect where the physics has it."""
    joint = None if name in WITHOUT_JOINT else JOINTS.get(name, 3)
    listed = EFFECTS[name].instances(around)
    coefficients = listed[0].coefficients if listed else (Coefficient("scale", 1e-5),)
    return Instance(name, joint, ARGUMENTS.get(name, ()), coefficients)


def moved_by(around: Circumstances, arm: Arm, instance: Instance, size: float) -> np.ndarray:
    """Where robocal has the target go with the first coefficient of this size [m]."""
    values = np.zeros(len(instance.coefficients))
    values[0] = size
    k = len(values)
    model = around.robot.geometry.with_frames(arm.base, arm.tool).with_frames_as_origin()
    fitted = FittedEffect(instance, values, np.zeros((k, k)))
    return predict(model, around, (fitted,)).p.T - predict(model, around, ()).p.T


def test_every_effect_file_is_in_the_catalogue_and_has_a_physics_here():
    assert stems("robocal/diagnosis/effects", ".py") == set(EFFECTS) == set(PHYSICS)
    assert all(isinstance(effect, Effect) for effect in EFFECTS.values())
    assert all(name == effect.name for name, effect in EFFECTS.items())


@pytest.mark.parametrize("name", PHYSICS)
def test_an_effect_moves_the_target_as_its_physics_says(name):
    arm, rows = arm_and_rows()
    around = seen(arm, rows)
    instance = instance_of(name, around)
    size = 0.1 * instance.coefficients[0].prior_std
    got = moved_by(around, arm, instance, size)
    joint = instance.joint or 0
    expected = (PHYSICS[name](arm, rows, joint, size) - arm.poses(rows.q))[:, :3, 3]
    scale = np.abs(expected).max()
    assert scale > 1e-8
    # Second-order terms of a tenth of the prior size are below a thousandth of the first.
    np.testing.assert_allclose(got, expected, atol=1e-3 * scale)


def test_a_link_that_bends_where_it_is_slender_at_its_tip_feels_the_end_moment_alone():
    arm, rows = arm_and_rows()
    around = seen(arm, rows)
    offered = [i for i in EFFECTS["link_bending"].instances(around) if i.joint == 2]
    (instance,) = [i for i in offered if i.arguments == (("end_force_share", 0.0),)]
    size = 0.1 * instance.coefficients[0].prior_std
    moved = (bent(arm, rows, 2, size, by_end_moment=True) - arm.poses(rows.q))[:, :3, 3]
    scale = np.abs(moved).max()
    np.testing.assert_allclose(moved_by(around, arm, instance, size), moved, atol=1e-3 * scale)


@pytest.mark.parametrize("name", [name for name in EFFECTS if name not in UNSEEN])
def test_an_effect_offers_its_place_where_the_rows_have_all_columns(name):
    arm, rows = arm_and_rows()
    around = seen(arm, rows)
    offered = {(i.joint, tuple(n for n, _ in i.arguments)) for i in EFFECTS[name].instances(around)}
    wanted = instance_of(name, around)
    assert (wanted.joint, tuple(n for n, _ in wanted.arguments)) in offered


@pytest.mark.parametrize("name", ["base_compliance", "link_bending"])
def test_without_stated_masses_only_a_payload_that_varies_shows_what_the_whole_load_bends(name):
    stated = seen(*arm_and_rows())
    unstated = replace(stated, robot=replace(stated.robot, masses=None))
    constant = {"payload": np.full(N, 2.0)}
    effect = EFFECTS[name]
    assert effect.needs == "link masses in robot.yaml, or payload_kg, varying"
    assert effect.instances(unstated)
    assert not effect.instances(replace(unstated, **constant))
    assert effect.instances(replace(stated, **constant))


def test_rows_in_the_gap_where_a_step_may_be_get_the_share_to_expect():
    arm, rows = arm_and_rows()
    around = seen(arm, rows)
    before, after = 10, 14
    fitted = around.rows(np.array([k for k in range(N) if not before < k < after]))
    steps = EFFECTS["encoder_step"].instances(fitted)
    (step,) = [i for i in steps if i.joint == 3 and i.argument("line") == around.lines[after]]
    (moved,) = EFFECTS["encoder_step"].moves(around, step).values()
    expected = np.interp(np.arange(N), [before, after], [0.0, 1.0])
    np.testing.assert_allclose(moved[:, 0], expected)


def test_rows_without_a_column_do_not_offer_what_needs_it():
    arm, rows = arm_and_rows()
    around = seen(arm, rows)
    blind = replace(around, temperature=np.full(N, np.nan), payload=np.full(N, np.nan))
    for name in ("thermal_expansion", "joint_thermal_drift", "payload_compliance"):
        assert not EFFECTS[name].instances(blind)
    assert EFFECTS["warm_up"].instances(blind)


def test_unknown_masses_load_a_joint_as_masses_at_the_ends_of_the_links_do():
    arm, rows = arm_and_rows()
    mass = np.array([0.0, 3.0, 0.0, 2.0, 0.0, 0.0])
    load = replace(rows.load, mass=mass, centre=np.zeros((6, 3)), payload=np.zeros(N))
    rows = replace(rows, load=load)
    around = seen(arm, rows)
    around = replace(around, robot=replace(around.robot, masses=None))
    (instance,) = [i for i in EFFECTS["joint_compliance"].instances(around) if i.joint == 2]
    names = [coefficient.name for coefficient in instance.coefficients]
    points = ["2", "4", "tip"]
    assert names == [f"compliance_times_mass_{p}_rad_kg_per_nm" for p in points]
    compliance = 2e-6
    values = compliance * np.array([3.0, 2.0, 0.0])
    model = around.robot.geometry.with_frames(arm.base, arm.tool).with_frames_as_origin()
    fitted = FittedEffect(instance, values, np.zeros((3, 3)))
    got = predict(model, around, (fitted,)).p.T - predict(model, around, ()).p.T
    moved = PHYSICS["joint_compliance"](arm, rows, 2, compliance) - arm.poses(rows.q)
    np.testing.assert_allclose(got, moved[:, :3, 3], atol=1e-3 * np.abs(moved).max())


def test_a_stand_that_settles_has_come_to_its_place_at_the_end_and_most_of_the_way_by_half_time():
    arm, rows = arm_and_rows()
    around = seen(arm, rows)
    steady, settling = EFFECTS["base_drift"].instances(around)
    ways = [EFFECTS["base_drift"].moves(around, one)[5 * 6][:, 0] for one in (steady, settling)]
    share = share_of_time(rows)
    np.testing.assert_allclose(ways[0], share)
    expected = 1.0 - np.exp(-share / 0.35)
    np.testing.assert_allclose(ways[1], expected / expected[-1])
