"""The emulated world against positions worked out by hand and against statistics."""

import json
import math
import socket
import subprocess
import sys

import numpy as np
import pytest
from world_process import EXACT, ROBOTS, ROOT, pendulum, world

DEG = math.pi / 180


@pytest.fixture(scope="module")
def ur10e(tmp_path_factory):
    with world(tmp_path_factory.mktemp("ur10e"), "ur10e", seed=7, time_scale=50) as running:
        yield running


@pytest.mark.parametrize(
    ("robot", "q", "flange_mm"),
    [
        # All upright: d2 sideways; 290 + 310 + 70 up.
        ("staubli_tx60", [0] * 6, (0, 20, 670)),
        # Arm stretched along x: axis 2 at 90 degrees lays everything down.
        ("staubli_tx60", [0, 90 * DEG, 0, 0, 0, 0], (670, 20, 0)),
        # UR10e stretched: 612.7 + 571.55 backwards; 174.15 + 116.55 across; 180.7 - 119.85 up.
        ("ur10e", [0] * 6, (-1184.25, -290.7, 60.85)),
        # UR10e upright: 180.7 + 612.7 + 571.55 + 119.85.
        ("ur10e", [0, -90 * DEG, 0, -90 * DEG, 0, 0], (0, -290.7, 1484.8)),
        # SCARA: 300 and 250 at right angles; 220 - 50 high.
        ("abb_irb910sc", [0, 90 * DEG, 0.05, 0], (300, 250, 170)),
    ],
)
def test_the_flange_is_where_the_data_sheet_puts_it(tmp_path, robot, q, flange_mm):
    with world(tmp_path, robot, **EXACT) as exact:
        position = np.array(exact.ask("truth", joints=q)["position"])
    np.testing.assert_allclose(position * 1e3, flange_mm, atol=1e-9)


def test_base_and_tool_frames_turn_about_z_then_y_then_x(tmp_path):
    frames = {
        "base": {"xyz_mm": [1000, 0, 0], "ypr_deg": [90, 90, 0]},
        "tool": {"xyz_mm": [0, 0, 100], "ypr_deg": [0, 0, 90]},
    }
    with world(tmp_path, pendulum(tmp_path), **{**EXACT, **frames}) as cell:
        truth = cell.ask("truth", joints=[0])
    # The rod's end (1, 0, 0.1) pitched by 90 degrees is (0.1, 0, -1), then yawed (0, 0.1, -1).
    np.testing.assert_allclose(truth["position"], (1, 0.1, -1), atol=1e-12)
    # Columns of the orientation: Rz(90) Ry(90) Rx(90) sends x to -z, y to y, z to x: Ry(90).
    half = math.sqrt(0.5)
    np.testing.assert_allclose(truth["orientation"], (half, 0, half, 0), atol=1e-12)


def test_true_geometry_scatters_about_the_nominal_one_as_configured(tmp_path):
    errors = {"length": [], "angle": []}
    for seed in range(4):
        with world(tmp_path, "staubli_tx60", seed=seed) as cell:
            truth = cell.ask("truth")
        # Lengths and twists of the TX60 as printed by its maker [mm], [deg].
        errors["length"] += list(np.array(truth["d"]) * 1e3 - [0, 0, 20, 310, 0, 70])
        errors["length"] += list(np.array(truth["a"]) * 1e3 - [0, 290, 0, 0, 0, 0])
        errors["angle"] += list(np.array(truth["alpha"]) / DEG - [-90, 0, 90, -90, 90, 0])
        # Only axis 2 is parallel to the next one, and the last axis has no next.
        assert [joint for joint, beta in enumerate(truth["beta"], 1) if beta] == [2, 6]
    # 48 and 24 draws: the root mean square is within 40 % with more than 99.9 % probability.
    assert np.std(errors["length"]) == pytest.approx(0.5, rel=0.4)
    assert np.std(np.array(errors["angle"]) * DEG * 1e3) == pytest.approx(1.0, rel=0.45)


def test_the_seed_alone_decides_the_truth(tmp_path):
    truths = []
    for seed in (1, 1, 2):
        with world(tmp_path, seed=seed) as cell:
            truths.append([cell.ask("truth")[k] for k in ("theta", "d", "a", "base", "tool")])
    assert truths[0] == truths[1]
    assert truths[0] != truths[2]


def test_readings_scatter_by_the_instruments_noise_about_the_truth(ur10e):
    truth = ur10e.ask("truth")
    readings = [ur10e.ask("measure") for _ in range(500)]
    offsets = np.array([r["position"] for r in readings]) - truth["position"]
    reach = np.linalg.norm(truth["position"])
    sigma = math.sqrt(0.015e-3**2 + (6e-6 * reach) ** 2)
    # 1500 samples: the standard deviation is known to 1.8 %, the mean to sigma / sqrt(500).
    assert offsets.std() == pytest.approx(sigma, rel=0.08)
    assert np.abs(offsets.mean(axis=0)).max() < 5 * sigma / math.sqrt(500)
    turns = [
        2 * math.acos(min(1.0, abs(np.dot(r["orientation"], truth["orientation"]))))
        for r in readings
    ]
    # Three axes of 0.05 mrad each: the turn's root mean square is sqrt(3) times that.
    assert math.sqrt(np.mean(np.square(turns))) == pytest.approx(0.05e-3 * math.sqrt(3), rel=0.1)


def test_arrivals_scatter_but_a_standing_robot_does_not(tmp_path):
    still = {**EXACT, "repeatability_mm": 0.1, "time_scale": 200}
    with world(tmp_path, pendulum(tmp_path), **still) as cell:
        assert cell.ask("measure")["position"] == cell.ask("measure")["position"]
        ends = []
        for _ in range(60):
            cell.move_and_wait([0.02])
            cell.move_and_wait([0.0])
            ends.append(cell.ask("measure")["position"][1])
    # One joint of 1 m: the scatter is that of the tool; 60 arrivals know it to 9 %.
    assert np.std(ends) == pytest.approx(0.1e-3, rel=0.4)


def test_a_blocked_beam_gives_no_target(ur10e):
    ur10e.set("beam_blocked", True)
    assert ur10e.request("measure")["error"] == "no_target"
    ur10e.set("beam_blocked", False)
    assert ur10e.request("measure")["ok"]


def test_stage_sensors_read_what_was_set(tmp_path):
    with world(tmp_path, stage={"slide": 0.25}) as cell:
        assert cell.ask("stage", sensor="slide")["value"] == 0.25
        cell.set("stage", {"slide": 0.5})
        assert cell.ask("stage", sensor="slide")["value"] == 0.5
        assert cell.request("stage", sensor="rod")["error"] == "no_sensor"


@pytest.mark.parametrize(
    "line",
    [
        b"nonsense",
        b"[]",
        b"{}",
        b'{"op": "fly"}',
        b'{"op": "move"}',
        b'{"op": "move", "joints": "abc", "speed": 1, "acceleration": 1}',
        b'{"op": "move", "joints": [0, 0], "speed": 1, "acceleration": 1}',
        b'{"op": "move", "joints": [NaN, 0, 0, 0, 0, 0], "speed": 1, "acceleration": 1}',
        b'{"op": "move", "joints": [0, 0, 0, 0, 0, 0], "speed": 0, "acceleration": 1}',
        b'{"op": "set", "name": "gravity", "value": 0}',
        b'{"op": "set", "name": "safety", "value": "fine"}',
    ],
)
def test_a_request_that_makes_no_sense_is_answered_and_the_world_goes_on(ur10e, line):
    reply = ur10e.send(line)
    assert reply["ok"] is False
    assert reply["error"] == "bad_request"
    assert reply["message"]
    assert ur10e.ask("hello")["n_joints"] == 6


def test_several_clients_see_the_same_world(ur10e):
    with (
        socket.create_connection(("127.0.0.1", ur10e.port), 5) as second,
        second.makefile("rb") as lines,
    ):
        ur10e.set("payload_kg", 3.5)
        second.sendall(b'{"op": "conditions"}\n')
        assert json.loads(lines.readline())["payload_kg"] == 3.5


def test_the_world_ends_with_its_standard_input(tmp_path):
    with world(tmp_path) as cell:
        assert cell.process.poll() is None
        cell.process.stdin.close()
        assert cell.process.wait(3) == 0


@pytest.mark.parametrize(
    ("config", "named"),
    [
        ({"robott": "x"}, "robott"),
        ({}, "robot"),
        ({"robot": str(ROBOTS / "ur10e.yaml"), "noise": {"ppb": 1}}, "ppb"),
        ({"robot": str(ROBOTS / "ur10e.yaml"), "effects": [{"effect": "magic"}]}, "magic"),
        (
            {
                "robot": str(ROBOTS / "ur10e.yaml"),
                "effects": [{"effect": "backlash", "joint": 7, "width_mrad": 1}],
            },
            "joint 7",
        ),
    ],
)
def test_a_wrong_configuration_is_one_line_that_names_the_field(tmp_path, config, named):
    path = tmp_path / "world.json"
    path.write_text(json.dumps(config))
    ended = subprocess.run(
        [sys.executable, "-m", "drivers.emulators.world", "--config", str(path)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )
    assert ended.returncode == 2
    assert ended.stderr.count("\n") == 1
    assert named in ended.stderr
