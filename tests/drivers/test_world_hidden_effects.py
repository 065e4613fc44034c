"""More hidden effects of the emulated world, each against its equation worked out by hand."""

import math

import numpy as np
import pytest
from world_process import EXACT, pendulum, world

G = 9.80665
LINK_WEIGHT = 10 * G
"""Of the pendulum, 0.6 m out."""


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """A pendulum whose gravity points along -y, so that its torque is greatest at q = 0."""
    folder = tmp_path_factory.mktemp("pendulum")
    config = {**EXACT, "gravity": [0, -1, 0], "time_scale": 50}
    with world(folder, pendulum(folder), **config) as running:
        yield running


@pytest.fixture(scope="module")
def table_arm(tmp_path_factory):
    """The pendulum lying in the horizontal plane, gravity along -z."""
    folder = tmp_path_factory.mktemp("table")
    with world(folder, pendulum(folder), **EXACT, time_scale=50) as running:
        yield running


def hide(cell, effect, **entries):
    cell.set("effects", [{"effect": effect, **entries}])


def at(cell, q):
    """Where the target is once the arm stands at q."""
    cell.move_and_wait([q])
    return np.array(cell.ask("measure")["position"])


def angle(position):
    return math.atan2(position[1], position[0])


def test_payload_compliance_feels_the_payload_alone(arm):
    hide(arm, "payload_compliance", joint=1, compliance_rad_per_nm=1e-5)
    arm.set("payload_kg", 0)
    assert angle(at(arm, 0.0)) == 0.0
    arm.set("payload_kg", 5)
    assert angle(at(arm, 0.0)) == pytest.approx(-1e-5 * 5 * G, rel=1e-9)
    arm.set("payload_kg", 0)


def test_a_hardening_joint_yields_less_to_more_load(arm):
    entries = {"joint": 1, "compliance_rad_per_nm": 1e-5, "hardening_nm": 40.0}
    hide(arm, "joint_compliance", **entries)
    expected = -1e-5 * 40.0 * math.tanh(0.6 * LINK_WEIGHT / 40.0)
    assert angle(at(arm, 0.0)) == pytest.approx(expected, rel=1e-9)


def test_play_is_pressed_to_the_side_of_the_load(arm):
    hide(arm, "load_backlash", joint=1, width_mrad=0.4)
    # Gravity pulls a rod along +x down (clockwise), one along -x too (counter-clockwise).
    assert angle(at(arm, 0.3)) - 0.3 == pytest.approx(-0.2e-3)
    assert angle(at(arm, 2.5)) - 2.5 == pytest.approx(0.2e-3)


def test_a_link_bends_as_the_textbooks_cantilever_with_a_weight_at_its_tip(arm):
    hide(arm, "link_bending", joint=1, compliance_rad_per_nm=1e-5)
    arm.set("payload_kg", 3)
    # The payload pulls at the tip of 1 m: shift F L^3 / (3 EI), and L / EI is the compliance.
    assert at(arm, 0.0)[1] == pytest.approx(-1e-5 * 3 * G / 3, rel=1e-9)
    # Along the link the weight bends nothing.
    np.testing.assert_allclose(at(arm, math.pi / 2), [0, 1, 0], atol=1e-12)
    arm.set("payload_kg", 0)


def test_a_bent_link_turns_its_tip_by_half_of_load_times_length_squared(tmp_path):
    config = {**EXACT, "gravity": [0, -1, 0], "payload_kg": 3}
    tool = {"xyz_mm": [200, 0, 0], "ypr_deg": [0, 0, 0]}
    effect = {"effect": "link_bending", "joint": 1, "compliance_rad_per_nm": 1e-5}
    with world(tmp_path, pendulum(tmp_path), **{**config, "tool": tool}, effects=[effect]) as cell:
        down = cell.ask("measure")["position"][1]
    # The payload hangs 0.2 m beyond the tip: force F and moment 0.2 F there.
    F = 3 * G
    tip, turn = F / 3 + 0.2 * F / 2, F / 2 + 0.2 * F
    assert down == pytest.approx(-1e-5 * (tip + 0.2 * turn), rel=1e-6)


def test_the_base_tilts_with_the_overturning_moment(table_arm):
    hide(table_arm, "base_compliance", compliance_rad_per_nm=1e-5)
    tilt = 1e-5 * 0.6 * LINK_WEIGHT
    assert at(table_arm, 0.0)[2] == pytest.approx(-math.sin(tilt), rel=1e-9)
    assert at(table_arm, math.pi / 2)[2] == pytest.approx(-math.sin(tilt), rel=1e-9)


def test_an_encoders_gain_shows_in_proportion_to_the_angle(arm):
    hide(arm, "encoder_gain", joint=1, gain_ppm=200)
    for q in (-1.0, 0.5):
        assert angle(at(arm, q)) - q == pytest.approx(200e-6 * q, rel=1e-6)


def test_a_neighbouring_harmonic_joins_the_first(arm):
    entries = {"order": 1, "amplitude_mrad": 1, "neighbour_order": 2, "neighbour_share": 0.25}
    hide(arm, "gear_harmonic", joint=1, **entries)
    expected = 1e-3 * (math.sin(0.7) + 0.25 * math.cos(1.4))
    assert angle(at(arm, 0.7)) - 0.7 == pytest.approx(expected, rel=1e-6)


TWO_LINKS = """
name: two-links
convention: mdh
joints:
  - {type: revolute, theta_deg: 0, d_mm: 0, a_mm: 1000, alpha_deg: 0, beta_deg: 0}
  - {type: revolute, theta_deg: 0, d_mm: 0, a_mm: 500, alpha_deg: 0, beta_deg: 0}
"""


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        ({"effect": "joint_coupling", "coupling_mrad_per_rad": 2.0}, 2e-3 * 0.8),
        (
            {"effect": "four_bar", "amplitude_mrad": 1.0, "phase_deg": 30.0},
            1e-3 * (math.cos(0.8 + math.pi / 6) + 0.4 * math.cos(1.6)),
        ),
    ],
)
def test_one_joint_leaks_into_another(tmp_path, effect, expected):
    (tmp_path / "two.yaml").write_text(TWO_LINKS)
    with world(tmp_path, tmp_path / "two.yaml", **EXACT) as cell:
        cell.set("effects", [{**effect, "joint": 2, "driven_by": 1}])
        true = cell.ask("truth", joints=[0.8, 0.3])["true_joints"]
    assert true == pytest.approx([0.8, 0.3 + expected], abs=1e-12)


def test_a_coupling_to_a_joint_that_is_not_there_is_refused(arm):
    effect = {"effect": "joint_coupling", "joint": 1, "driven_by": 2, "coupling_mrad_per_rad": 1}
    reply = arm.request("set", name="effect", value=effect)
    assert not reply["ok"]
    assert "driven_by 2" in reply["message"]


def test_the_rest_of_a_move_dies_away_after_the_arrival(arm):
    arm.set("effects", [])
    arm.move_and_wait([0.0])
    hide(arm, "settling", joint=1, rest_ppm=300, time_constant_s=4.0, full_speed=3.0)
    segment = arm.ask("move", joints=[1.0], speed=1.5, acceleration=30.0)["segment"]
    while arm.ask("robot")["moving"]:
        pass
    reading = arm.ask("measure")
    waited = reading["time_s"] - segment["start_s"] - segment["duration_s"]
    # Half the full speed, a move of 1 rad, and 300 ppm are left after one second.
    expected = -300e-6 * 0.5 * math.exp((1.0 - waited) / 4.0)
    assert angle(reading["position"]) - 1.0 == pytest.approx(expected, rel=1e-6)


def test_a_joints_zero_moves_with_temperature(arm):
    hide(arm, "joint_thermal_drift", joint=1, drift_urad_per_k=10)
    arm.set("temperature_degc", 32)
    assert angle(at(arm, 0.4)) - 0.4 == pytest.approx(120e-6, rel=1e-6)
    arm.set("temperature_degc", None)


def test_links_expand_each_by_its_own_share(arm):
    hide(arm, "thermal_expansion", cte_ppm_per_k=20, link_shares=[1.4])
    arm.set("temperature_degc", 30)
    assert np.linalg.norm(at(arm, 0.0)) == pytest.approx(1 + 1.4 * 200e-6, abs=1e-12)
    arm.set("temperature_degc", None)


def test_the_arm_grows_with_time_without_any_temperature(arm):
    hide(arm, "warm_up", growth_ppm=300, time_constant_s=60)
    arm.move_and_wait([0.0])
    reading = arm.ask("measure")
    grown = 300e-6 * (1 - math.exp(-reading["time_s"] / 60))
    assert np.linalg.norm(reading["position"]) == pytest.approx(1 + grown, abs=1e-12)
    assert arm.ask("conditions")["temperature_degc"] == 20


def test_a_drift_may_die_away(arm):
    hide(arm, "base_drift", rate_mm_per_h=[0, 0, 360], time_constant_s=30)
    reading = arm.ask("measure")
    expected = 0.1e-3 * 30 * (1 - math.exp(-reading["time_s"] / 30))
    assert reading["position"][2] == pytest.approx(expected, rel=1e-9)


def test_robot_and_joint_jump_after_a_number_of_readings(tmp_path):
    effects = [
        {"effect": "base_step", "step_mm": [0, 0, 0.2], "after_readings": 2},
        {"effect": "encoder_step", "joint": 1, "step_mrad": 0.3, "after_readings": 4},
    ]
    with world(tmp_path, pendulum(tmp_path), **EXACT, effects=effects) as cell:
        seen = np.array([cell.ask("measure")["position"] for _ in range(6)])
    np.testing.assert_allclose(seen[:, 2], [0, 0, *[0.2e-3] * 4], atol=1e-12)
    np.testing.assert_allclose(seen[:, 1], [*[0] * 4, *[math.sin(0.3e-3)] * 2], atol=1e-12)


def test_a_step_may_creep_to_its_end(tmp_path):
    step = {"effect": "tool_step", "step_mm": [0, 0.3, 0], "at_s": 10, "creep_s": 5}
    with world(tmp_path, pendulum(tmp_path), **EXACT, effects=[step], time_scale=50) as cell:
        reading = cell.ask("measure")
        assert reading["position"][1] == 0.0
        while reading["time_s"] < 20:
            reading = cell.ask("measure")
    expected = 0.3e-3 * (1 - math.exp(-(reading["time_s"] - 10) / 5))
    assert reading["position"][1] == pytest.approx(expected, rel=1e-9)


def test_an_instruments_scale_stretches_every_range(arm):
    hide(arm, "instrument_scale", scale_ppm=15)
    np.testing.assert_allclose(at(arm, 0.0), [1 + 15e-6, 0, 0], atol=1e-12)


def test_an_instruments_circles_err_twice_a_turn(table_arm):
    entries = {"azimuth_phase_deg": 30, "elevation_urad": 20, "elevation_phase_deg": 90}
    hide(table_arm, "instrument_angle", azimuth_urad=40, **entries)
    seen = at(table_arm, 0.5)
    turned = angle(seen) - 0.5
    assert turned == pytest.approx(40e-6 * math.sin(1.0 + math.pi / 6), rel=1e-6)
    assert seen[2] == pytest.approx(math.sin(20e-6), rel=1e-6)
    assert np.linalg.norm(seen) == pytest.approx(1.0, abs=1e-12)


def test_hysteresis_remembers_where_the_arm_has_been(arm):
    arm.set("effects", [])
    for q in (-1.0, 1.0):
        arm.move_and_wait([q])
    hide(arm, "hysteresis", joint=1, height_mrad=0.4, loop_rad=0.5)
    seen = [angle(at(arm, q)) - q for q in (1.0, 0.8, 0.0, 0.2)]
    # Pulled back fully; 0.2 rad back out of 0.5; fully the other way; again 0.2 rad back.
    expected = [-0.2e-3, -0.2e-3 * 0.6, 0.2e-3, 0.2e-3 * 0.6]
    np.testing.assert_allclose(seen, expected, atol=1e-12)


def test_a_wobbling_axis_goes_round_twice_a_turn(table_arm):
    hide(table_arm, "axis_wobble", joint=1, tilt_urad=100, shift_um=30)
    # At a quarter turn the wobble points along -x: it shifts so, and tips y down.
    seen = at(table_arm, math.pi / 2)
    np.testing.assert_allclose(seen, [-30e-6, 1, -100e-6], atol=1e-8)


def test_a_broken_spring_is_soft_up_to_its_knee(arm):
    entries = {"soft_rad_per_nm": 1e-5, "knee_nm": 20, "stiff_share": 0.25}
    hide(arm, "stiffening_compliance", joint=1, **entries)
    expected = -1e-5 * (20 + 0.25 * (0.6 * LINK_WEIGHT - 20))
    assert angle(at(arm, 0.0)) == pytest.approx(expected, rel=1e-9)


def test_a_bearing_yields_across_its_axis(table_arm):
    hide(table_arm, "bearing_compliance", joint=1, compliance_rad_per_nm=1e-6)
    assert at(table_arm, 0.0)[2] == pytest.approx(-1e-6 * 0.6 * LINK_WEIGHT, rel=1e-6)


def test_interpolation_errs_once_a_line(arm):
    hide(arm, "subdivision_error", joint=1, lines=2000, amplitude_urad=50)
    assert angle(at(arm, 0.3)) - 0.3 == pytest.approx(50e-6 * math.sin(600), rel=1e-5)


def test_the_station_sways_with_its_period(arm):
    hide(arm, "station_sway", sway_mm=[0, 0, 0.2], period_s=20)
    reading = arm.ask("measure")
    expected = 0.2e-3 * math.sin(2 * math.pi * reading["time_s"] / 20)
    assert reading["position"][2] == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize(
    ("effect", "condition", "shift"),
    [
        (
            {"effect": "gripper_sag", "shift_mm": [0, 0, 0.4], "full_kg": 4},
            ("payload_kg", 1),
            0.2e-3,
        ),
        ({"effect": "tool_heat", "shift_um_per_k": [0, 0, 5]}, ("temperature_degc", 30), 50e-6),
    ],
)
def test_the_tools_mount_gives_way(arm, effect, condition, shift):
    arm.set("effects", [effect])
    arm.set(*condition)
    assert at(arm, 0.0)[2] == pytest.approx(shift, rel=1e-9)
    arm.set("payload_kg", 0)
    arm.set("temperature_degc", None)


def test_a_target_turned_across_the_beam_seems_farther_off(arm):
    hide(arm, "target_acceptance", depth_um=80)
    # The target's z stands across the beam in this plane.
    np.testing.assert_allclose(at(arm, 0.0), [1 + 80e-6, 0, 0], atol=1e-12)
