"""Each hidden effect of the emulated world against its equation worked out by hand."""

import math

import numpy as np
import pytest
from world_process import EXACT, pendulum, world

G = 9.80665


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    """A pendulum whose gravity points along -y, so that its torque is greatest at q = 0."""
    folder = tmp_path_factory.mktemp("pendulum")
    config = {**EXACT, "gravity": [0, -1, 0], "time_scale": 50}
    with world(folder, pendulum(folder), **config) as running:
        yield running


def angle(reading) -> float:
    x, y, _ = reading["position"]
    return math.atan2(y, x)


def test_joint_compliance_yields_to_the_moment_of_links_and_payload(arm):
    arm.set("effects", [{"effect": "joint_compliance", "joint": 1, "compliance_rad_per_nm": 1e-5}])
    arm.set("payload_kg", 0)
    arm.move_and_wait([0.0])
    # 10 kg at 0.6 m pull the rod down.
    assert angle(arm.ask("measure")) == pytest.approx(-1e-5 * 10 * G * 0.6, rel=1e-9)
    arm.set("payload_kg", 5)
    # The payload hangs at the target, 1 m out.
    assert angle(arm.ask("measure")) == pytest.approx(-1e-5 * (6 + 5) * G, rel=1e-9)
    arm.move_and_wait([math.pi / 3])
    sag = angle(arm.ask("measure")) - math.pi / 3
    assert sag == pytest.approx(-1e-5 * 11 * G * math.cos(math.pi / 3), rel=1e-6)
    arm.set("payload_kg", 0)


TWO_LINKS = """
name: two-links
convention: mdh
joints:
  - {type: revolute, theta_deg: 0, d_mm: 0, a_mm: 1000, alpha_deg: 0, beta_deg: 0}
  - {type: revolute, theta_deg: 0, d_mm: 0, a_mm: 500, alpha_deg: 0, beta_deg: 0}
links:
  - {mass_kg: 7, com_mm: [0, 0, 0]}
  - {mass_kg: 3, com_mm: [0, 0, 0]}
"""


@pytest.mark.parametrize(("joint", "moment"), [(1, 7 * 1.0 + 3 * 1.25), (2, 3 * 0.25)])
def test_each_joint_feels_the_weights_beyond_it_about_its_own_axis(tmp_path, joint, moment):
    (tmp_path / "two.yaml").write_text(TWO_LINKS)
    effect = {"effect": "joint_compliance", "joint": joint, "compliance_rad_per_nm": 1e-5}
    config = {**EXACT, "gravity": [0, -1, 0], "effects": [effect]}
    with world(tmp_path, tmp_path / "two.yaml", **config) as arm:
        true = arm.ask("truth", joints=[0, math.pi / 3])["true_joints"]
    # The first link lies along x; the second, of 0.5 m, at 60 degrees reaches 0.25 m farther.
    assert true[joint - 1] - [0, math.pi / 3][joint - 1] == pytest.approx(-1e-5 * moment * G)


def test_a_sliding_joint_yields_to_the_weight_along_it(tmp_path):
    config = {
        **EXACT,
        "links": [{"mass_kg": m, "com_mm": [0, 0, 0]} for m in (5, 4, 3, 2)],
        "effects": [{"effect": "joint_compliance", "joint": 3, "compliance_rad_per_nm": 1e-6}],
    }
    with world(tmp_path, "abb_irb910sc", **config) as scara:
        down = scara.ask("truth", joints=[0.3, 0.4, 0.1, 0])["true_joints"][2] - 0.1
    # Links 3 and 4 hang on the slide, which points down.
    assert down == pytest.approx(1e-6 * (3 + 2) * G, rel=1e-9)


@pytest.mark.parametrize("q", [0.0, 0.4, 2.0])
def test_a_gear_harmonic_is_a_sine_of_the_joint_angle(arm, q):
    arm.set(
        "effects",
        [
            {
                "effect": "gear_harmonic",
                "joint": 1,
                "order": 2,
                "amplitude_mrad": 0.5,
                "phase_deg": 30,
            }
        ],
    )
    arm.move_and_wait([q])
    error = angle(arm.ask("measure")) - q
    assert error == pytest.approx(0.5e-3 * math.sin(2 * q + math.pi / 6), abs=1e-12)


def test_backlash_lags_behind_the_last_motion(arm):
    arm.set("effects", [{"effect": "backlash", "joint": 1, "width_mrad": 0.4}])
    arm.move_and_wait([0.0])
    arm.move_and_wait([1.0])
    from_below = angle(arm.ask("measure"))
    arm.move_and_wait([2.0])
    arm.move_and_wait([1.0])
    from_above = angle(arm.ask("measure"))
    assert from_below - 1.0 == pytest.approx(-0.2e-3, abs=1e-12)
    assert from_above - 1.0 == pytest.approx(0.2e-3, abs=1e-12)


def test_backlash_keeps_the_direction_of_a_joint_that_stays(tmp_path):
    with world(tmp_path, "ur10e", time_scale=200) as cell:
        cell.move_and_wait([0.1, -0.1, 0, 0, 0, 0])
        cell.move_and_wait([0.2, -0.1, 0, 0, 0, 0])
        assert cell.ask("truth")["circumstances"]["last_motion"] == [1, -1, 0, 0, 0, 0]


def test_thermal_expansion_stretches_the_links(arm):
    arm.set("effects", [{"effect": "thermal_expansion", "cte_ppm_per_k": 23, "reference_degc": 20}])
    arm.set("temperature_degc", 35)
    length = np.linalg.norm(arm.ask("measure")["position"])
    assert length == pytest.approx(1.0 + 23e-6 * 15, abs=1e-12)
    assert arm.ask("conditions")["temperature_degc"] == 35
    arm.set("temperature_degc", None)


def test_the_arm_warms_up_exponentially_in_world_time(tmp_path):
    warm_up = {"start_degc": 20, "final_degc": 35, "time_constant_s": 1800}
    with world(tmp_path, time_scale=20000, temperature=warm_up) as cell:
        for _ in range(20):
            reply = cell.ask("conditions")
            expected = 20 + 15 * (1 - math.exp(-reply["time_s"] / 1800))
            # The clock goes on for some microseconds, 20000-fold, between stamp and temperature.
            assert reply["temperature_degc"] == pytest.approx(expected, abs=0.05)
        assert 20 < reply["temperature_degc"] < 35


def test_base_drift_grows_with_world_time(arm):
    arm.set("effects", [{"effect": "base_drift", "rate_mm_per_h": [36, 0, -72]}])
    arm.move_and_wait([math.pi / 2])
    reading = arm.ask("measure")
    hours = reading["time_s"] / 3600
    shift = np.array(reading["position"]) - (0, 1, 0)
    np.testing.assert_allclose(shift, np.array([36e-3, 0, -72e-3]) * hours, atol=1e-12)


def test_base_drift_may_turn_the_base(arm):
    arm.set(
        "effects",
        [{"effect": "base_drift", "rate_mm_per_h": [0, 0, 0], "turn_mrad_per_h": [0, 0, 36]}],
    )
    arm.move_and_wait([0.5])
    reading = arm.ask("measure")
    assert angle(reading) == pytest.approx(0.5 + 36e-3 * reading["time_s"] / 3600, abs=1e-12)


def test_the_tool_slips_after_a_number_of_readings(tmp_path):
    step = {"effect": "tool_step", "step_mm": [0, 0.3, 0], "after_readings": 3}
    with world(tmp_path, pendulum(tmp_path), **EXACT, effects=[step]) as cell:
        y = [cell.ask("measure")["position"][1] for _ in range(5)]
    assert y == pytest.approx([0, 0, 0, 0.3e-3, 0.3e-3], abs=1e-12)


def test_the_tool_slips_at_a_moment(tmp_path):
    step = {"effect": "tool_step", "step_mm": [0, 0.3, 0], "at_s": 30}
    with world(tmp_path, pendulum(tmp_path), **EXACT, effects=[step], time_scale=50) as cell:
        seen = []
        while not seen or seen[-1]["time_s"] < 35:
            seen.append(cell.ask("measure"))
    for reading in seen:
        assert reading["position"][1] == pytest.approx(0.3e-3 * (reading["time_s"] >= 30))


def test_effects_add_up(arm):
    first = {
        "effect": "gear_harmonic",
        "joint": 1,
        "order": 1,
        "amplitude_mrad": 1,
        "phase_deg": 90,
    }
    arm.set("effects", [first])
    arm.set("effect", {**first, "order": 3})
    arm.move_and_wait([0.0])
    assert angle(arm.ask("measure")) == pytest.approx(2e-3, abs=1e-12)
    arm.set("effects", [])
    assert angle(arm.ask("measure")) == 0.0


def test_an_unknown_effect_is_refused_with_the_known_names(arm):
    reply = arm.request("set", name="effect", value={"effect": "magic"})
    assert not reply["ok"]
    assert "joint_compliance" in reply["message"]
