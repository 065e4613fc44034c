"""`robocal basecal` from files, with two robots' own kinematics, and what bad files are told."""

import csv
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import yaml

from robocal.formats.robot_yaml import read_robot
from robocal.formats.stage import read_stage
from robocal.robots.library import robot_path
from tests.elementary_kinematics import load_arm
from tests.robocal.base_calibration.stage_cell import (
    Cell,
    Faults,
    Plan,
    frame,
    true_cups,
)

NEEDLE = np.array([0.01, -0.02, 0.1])
CELL = Cell([frame([0.25, 0.30, 0.35], [0, 0, -np.pi / 2])], frame([0.5, -2.0, 0.3], [0, 0, 1.5]))
HEADER = [
    "robot", "cup", "j1_deg", "j2_deg", "j3_deg", "j3_mm", "j4_deg", "j5_deg", "j6_deg",
    "slide_mm", "rod_angle_deg", "rod_length_mm",
]  # fmt: skip


def with_needle(name: str):
    arm = load_arm(name)
    tool = np.eye(4)
    tool[:3, 3] = NEEDLE
    return replace(arm, tool=arm.tool @ tool)


def joints_for(arm, place: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Joints by plain Newton on differences of the elementary kinematics."""
    q = start.astype(float)
    for _ in range(80):
        here = arm.poses(q[None])[0, :3, 3]
        steps = np.tile(q, (len(q), 1)) + 1e-6 * np.eye(len(q))
        J = (arm.poses(steps)[:, :3, 3] - here).T / 1e-6
        q = q + np.clip(np.linalg.pinv(J, rcond=1e-3) @ (place - here), -0.2, 0.2)
    assert np.linalg.norm(arm.poses(q[None])[0, :3, 3] - place) < 1e-7
    return q


def plan() -> Plan:
    return Plan.of([
        (0, 1, 0.0, 0.0, 0.30),
        (0, 0, 0.0, 0.0, 0.0),
        (0, 1, 0.15, 0.7, 0.25),
        (0, 1, 0.0, 2.4, 0.20),
        (1, 1, 2.0, 0.9, 0.25),
        (1, 1, 2.0, 1.6, 0.30),
        (1, 0, 2.1, 0.0, 0.0),
        (1, 1, 2.2, 1.2, 0.20),
    ])


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A stage folder: ABB IRB 120 as master, IRB 910SC as slave, noise-free touches."""
    folder = tmp_path_factory.mktemp("stage")
    shutil.copy(robot_path("abb_irb120"), folder / "master.yaml")
    shutil.copy(robot_path("abb_irb910sc"), folder / "slave.yaml")
    arms = (with_needle("abb_irb120"), with_needle("abb_irb910sc"))
    starts = (np.array([0.8, 0.2, 0.1, 0.0, 0.6, 0.0]), np.array([0.3, 0.8, 0.05, 0.0]))
    rows, touches = [], plan()
    cups = true_cups(CELL, touches, Faults())
    back = np.linalg.inv(CELL.slave)
    for k, cup in enumerate(cups):
        slave = int(touches.by_slave[k])
        place = back[:3, :3] @ cup + back[:3, 3] if slave else cup
        q = joints_for(arms[slave], place, starts[slave])
        row = dict.fromkeys(HEADER, "")
        row.update(robot=("master", "slave")[slave], cup=("slide", "rod")[int(touches.on_rod[k])])
        names = ["j1_deg", "j2_deg", "j3_mm" if slave else "j3_deg", "j4_deg", "j5_deg", "j6_deg"]
        for name, value in zip(names, q, strict=False):
            row[name] = repr(float(value * 1e3 if name == "j3_mm" else np.rad2deg(value)))
        row["slide_mm"] = repr(float(touches.slide[k] * 1e3))
        if touches.on_rod[k]:
            row["rod_angle_deg"] = repr(float(np.rad2deg(touches.angle[k])))
            row["rod_length_mm"] = repr(float(touches.length[k] * 1e3))
        rows.append(row)
    with (folder / "touches.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, HEADER)
        writer.writeheader()
        writer.writerows(rows)
    needle = [float(value * 1e3) for value in NEEDLE]
    document = {
        "master": {"robot": "master.yaml", "needle_mm": needle},
        "slave": {"robot": "slave.yaml", "needle_mm": needle},
        "stage": {
            "sigma_slide_mm": 0.05,
            "sigma_rod_mm": 0.02,
            "sigma_angle_mrad": 0.1,
            "level_in_master": True,
            "level_in_slave": False,
        },
        "touches": "touches.csv",
    }
    (folder / "stage.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    return folder


@pytest.fixture
def folder(written, tmp_path):
    """A copy that a test may spoil."""
    return shutil.copytree(written, tmp_path / "stage")


def edit(folder, name: str, old: str, new: str) -> None:
    text = (folder / name).read_text(encoding="utf-8")
    assert old in text
    (folder / name).write_text(text.replace(old, new, 1), encoding="utf-8")


def test_basecal_finds_where_the_slave_stands(written, tmp_path, call):
    status, out, _ = call("basecal", written / "stage.yaml", "--out", tmp_path / "out", "--json")
    assert status == 0
    document = json.loads(out)
    assert document == json.loads((tmp_path / "out" / "basecal.json").read_text())
    np.testing.assert_allclose(document["transform"]["xyz_mm"], [500, -2000, 300], atol=1e-3)
    yaw = np.rad2deg(1.5)
    np.testing.assert_allclose(document["transform"]["ypr_deg"], [yaw, 0, 0], atol=1e-4)
    assert document["undetermined"] == []
    assert document["residual_rms_mm"] < 1e-4
    assert len(document["std"]) == 6
    assert "off the polar angle" in document["projection"]["refusal"]
    assert {row["name"] for row in document["sensor_corrections"]} >= {"angle_zero_mrad", "sag_mm"}
    assert document["next_touch"]["robot"] in ("master", "slave")


def test_the_next_touch_is_one_that_the_robot_reaches(written, tmp_path, call):
    _, out, _ = call("basecal", written / "stage.yaml", "--out", tmp_path / "out", "--json")
    touch = json.loads(out)["next_touch"]
    name = {"master": "abb_irb120", "slave": "abb_irb910sc"}[touch["robot"]]
    start = read_stage(written / "stage.yaml").pair
    joints = {"master": start.master_joints, "slave": start.slave_joints}[touch["robot"]][0]
    joints_for(with_needle(name), np.array(touch["place_mm"]) * 1e-3, joints)


def test_the_terminal_is_told_in_lines(written, tmp_path, call):
    status, out, _ = call("basecal", written / "stage.yaml", "--out", tmp_path / "out")
    assert status == 0
    assert "8 touches" in out
    assert "best next touch" in out


def test_two_slave_touches_are_answered_with_nulls_and_words(folder, tmp_path, call):
    lines = (folder / "touches.csv").read_text(encoding="utf-8").splitlines()
    (folder / "touches.csv").write_text("\n".join(lines[:7]) + "\n", encoding="utf-8")
    status, out, _ = call("basecal", folder / "stage.yaml", "--out", tmp_path / "out", "--json")
    document = json.loads(out)
    assert status == 0
    assert None in document["std"]
    assert "R1R2" in document["undetermined"][0]["direction"]
    assert "slave" in document["undetermined"][0]["fixed_by"]


@pytest.mark.parametrize("rows", [5, 4, 1], ids=["one by the slave", "none", "one in all"])
def test_fewer_than_two_touches_by_a_robot_leave_by_status_3(folder, tmp_path, call, rows):
    lines = (folder / "touches.csv").read_text(encoding="utf-8").splitlines()
    (folder / "touches.csv").write_text("\n".join(lines[: rows + 1]) + "\n", encoding="utf-8")
    status, _, complaint = call("basecal", folder / "stage.yaml", "--out", tmp_path / "out")
    assert status == 3
    assert "each robot must touch at least twice" in complaint
    assert not (tmp_path / "out").exists()


def test_wrong_priors_and_ranges_reach_the_numerics(folder):
    edit(folder, "stage.yaml", "  sigma_rod_mm: 0.02\n",
         "  sigma_rod_mm: 0.02\n  prior_std: {angle_zero_mrad: 0, rod_zero_mm: 0.5}\n"
         "  slide_range_mm: [0, 2500]\n")  # fmt: skip
    measured = read_stage(folder / "stage.yaml")
    assert measured.stage.prior_std[0] == 0.0
    assert measured.stage.prior_std[1] == pytest.approx(0.5e-3)
    assert measured.travel.slide == (0.0, 2.5)


UNITS = [
    ({"slide_mm": 1e-3}, "slide_mm holds metres"),
    ({"rod_angle_deg": np.pi / 180}, "rod_angle_deg holds radians"),
    ({"j3_mm": 1e-3}, "column 'j3_mm' stays below 0.07 mm in every touch"),
]  # fmt: skip


@pytest.mark.parametrize(("factors", "sentence"), UNITS)
def test_a_column_in_another_unit_is_named(folder, tmp_path, call, factors, sentence):
    with (folder / "touches.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    for row in rows:
        for column, factor in factors.items():
            of_slave = column.startswith("j") and row["robot"] == "slave"
            if row[column] and (not of_slave or column == "j3_mm"):
                row[column] = repr(float(row[column]) * factor)
    with (folder / "touches.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, HEADER)
        writer.writeheader()
        writer.writerows(rows)
    status, _, complaint = call("basecal", folder / "stage.yaml", "--out", tmp_path / "out")
    assert status == (2 if "column" in sentence else 3)
    assert sentence in complaint
    assert not (tmp_path / "out").exists()


def test_a_touch_beyond_the_joint_limits_is_refused(folder, tmp_path, call):
    with (folder / "touches.csv").open(encoding="utf-8", newline="") as stream:
        first = next(csv.DictReader(stream))["j2_deg"]
    edit(folder, "touches.csv", first, "400")
    status, _, complaint = call("basecal", folder / "stage.yaml", "--out", tmp_path / "out")
    assert status == 2
    assert "touches.csv line 2: column 'j2_deg' is 400, outside the limits -110 to 110" in complaint


BAD = [
    ("stage.yaml", "sigma_slide_mm: 0.05", "sigma_slide_mm: 0", "must be positive, 1e-09 or more"),
    ("stage.yaml", "sigma_slide_mm: 0.05", "sigma_slide_mm: 1e9", "must not be above 1000"),
    ("stage.yaml", "level_in_master", "sigma_level_mrad: 1.0e-200\n  level_in_master",
     "field 'stage.sigma_level_mrad' must be positive, 1e-09 or more, not 1e-200"),
    ("stage.yaml", "level_in_master", "prior_std: {rod_zero_mm: 1.0e-200}\n  level_in_master",
     "field 'stage.prior_std.rod_zero_mm' must be positive, 1e-09 or more, not 1e-200"),
    ("stage.yaml", "master:", "master:\n  sigma_mm: 1.0e-100",
     "field 'master.sigma_mm' must be positive, 1e-09 or more, not 1e-100"),
    ("stage.yaml", "master:", "master:\n  sigma_joint_mrad: -5", "must not be negative"),
    ("stage.yaml", "sigma_slide_mm", "sigma_slid_mm", "field 'stage.sigma_slide_mm' is missing"),
    ("stage.yaml", "level_in_slave: false", "level_in_slave: perhaps", "must be true or false"),
    ("stage.yaml", "touches: touches.csv", "touches: ../touches.csv", "must name a file beside"),
    ("touches.csv", "master,rod", "mister,rod", "touches.csv line 2: column 'robot' must be"),
    ("touches.csv", "master,rod", "master,rood", "line 2: column 'cup' must be slide or rod"),
    ("touches.csv", "slide_mm", "slide_cm", "column 'slide_mm' is missing (found 'slide_cm')"),
    ("touches.csv", "j3_mm", "j3_m", "column 'j3_mm' is missing"),
    ("touches.csv", "300.0", "nan", "must be a number below"),
    ("touches.csv", "300.0", "-300.0", "line 2: column 'rod_length_mm' must be above zero"),
    ("touches.csv", "300.0", "", "line 2: column 'rod_length_mm' is empty; a touch of the rod cup"),
    ("master.yaml", "theta_deg: 0", "theta_deg: zero", "must be a number"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("file", "old", "new", "complaint"), BAD, ids=[row[2] or "empty" for row in BAD]
)
def test_a_bad_file_is_one_line_and_status_2(folder, tmp_path, call, file, old, new, complaint):
    edit(folder, file, old, new)
    status, out, said = call("basecal", folder / "stage.yaml", "--out", tmp_path / "out")
    assert (status, out) == (2, "")
    assert complaint in said
    assert said.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_an_identified_model_stands_in_for_the_nominal_robot(folder, tmp_path, call):
    nominal = read_robot(folder / "master.yaml")
    assert nominal.n_joints == 6
    plain = read_stage(folder / "stage.yaml")
    model = identified(folder / "master.yaml", std=0.1e-3)
    (folder / "master_model.yaml").write_text(model, encoding="utf-8")
    edit(folder, "stage.yaml", "robot: master.yaml", "model: master_model.yaml")
    measured = read_stage(folder / "stage.yaml")
    np.testing.assert_allclose(measured.touches.tips, plain.touches.tips, atol=1e-9)
    grown = measured.touches.tip_covariance - plain.touches.tip_covariance
    # One uncertain length along axis 1 lifts all master tips together, the slave's not at all.
    np.testing.assert_allclose(grown[2:12:3, 2:12:3], 1e-8, rtol=1e-6)
    assert not grown[12:].any()


def identified(path, std: float) -> str:
    """A model.yaml with the nominal geometry and one uncertain length, d_1."""
    robot = yaml.safe_load(path.read_text(encoding="utf-8"))
    still = {"xyz_mm": [0, 0, 0], "ypr_deg": [0, 0, 0]}
    keys = ("theta_deg", "d_mm", "a_mm", "alpha_deg", "beta_deg")
    document = {
        "format": "robocal-model-1",
        "robot": robot,
        "links": [{key: joint[key] for key in keys} for joint in robot["joints"]],
        "base": still,
        "tool": still,
        "gravity": [0, 0, -1],
        "effects": [],
        "covariance": {"parameters": ["d_1"], "matrix_deg_mm": [[(std * 1e3) ** 2]]},
        "provenance": {
            "bundle_sha256": "0" * 64,
            "software_version": "0",
            "date": "2026-01-01T00:00:00+00:00",
            "strategy": "simultaneous",
        },
    }
    return yaml.safe_dump(document)
