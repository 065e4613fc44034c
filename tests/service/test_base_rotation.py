"""Lengths from one anchor do not show how the base is turned about it: every command says so.

The true base is turned at random.
"""

import csv
import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from robocal.formats.bundle import read_bundle
from robocal.formats.model_yaml import read_model
from robocal.frames import xyz_ypr_from_frame
from service.parameters import store
from tests.measured_cell import Cell, true_cell, write_bundle
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import content_of

ROBOT = "ur5e"
ANCHOR = np.array([0.2, -0.3, 0.1])
SIGMA = 2e-5
UNKNOWN = "how the base is turned about the anchor is not known"
STD = ("u_x_mm", "u_y_mm", "u_z_mm")


@pytest.fixture(scope="module")
def measured() -> Cell:
    return true_cell(ROBOT, 3)


@pytest.fixture
def lengths(measured, tmp_path) -> Path:
    """150 lengths from a stated anchor."""
    folder = tmp_path / "bundle"
    q = write_bundle(folder, ROBOT, measured, 150, 3, full_pose=False)
    length = np.linalg.norm(measured.true.poses(q)[:, :3, 3] - ANCHOR, axis=1)
    length += np.random.default_rng(4).normal(size=len(q)) * SIGMA
    head = ",".join([*(f"j{joint}_deg" for joint in range(1, 7)), "distance_mm"])
    table = np.column_stack([np.degrees(q), length * 1e3]).tolist()
    rows = [",".join(f"{value:.9f}" for value in row) for row in table]
    (folder / "measurements.csv").write_text("\n".join([head, *rows]) + "\n")
    state(folder, "anchor: {xyz_mm: [200, -300, 100]}")
    return folder


@pytest.fixture
def model(lengths, call, tmp_path) -> Path:
    assert call("identify", lengths, "--out", tmp_path / "found")[0] == 0
    return tmp_path / "found" / "model.yaml"


def state(folder: Path, line: str) -> None:
    with (folder / "campaign.yaml").open("a") as file:
        file.write(f"{line}\n")


def state_base(folder: Path, measured: Cell) -> None:
    x, y, z, *turns = xyz_ypr_from_frame(measured.true.base).tolist()
    angles = np.degrees(turns).tolist()
    state(folder, f"base_guess: {{xyz_mm: {[x * 1e3, y * 1e3, z * 1e3]}, ypr_deg: {angles}}}")


def joints_csv(path: Path, q: np.ndarray) -> Path:
    head = ",".join(f"j{joint}_deg" for joint in range(1, 7))
    rows = [",".join(map(repr, row)) for row in np.degrees(q).tolist()]
    path.write_text("\n".join([head, *rows]) + "\n")
    return path


def joints(measured: Cell) -> np.ndarray:
    return measured.nominal.draw(np.random.default_rng(6), 5, widest=2.0)


def test_the_rotation_is_known_by_any_position_or_a_statement(measured, lengths, tmp_path):
    assert not read_bundle(lengths).base_rotation_known
    state_base(lengths, measured)
    assert read_bundle(lengths).base_rotation_known
    write_bundle(tmp_path / "positions", ROBOT, measured, 20, full_pose=False)
    assert read_bundle(tmp_path / "positions").base_rotation_known


def test_an_identification_names_it_and_gives_the_base_no_uncertainty(lengths, call, tmp_path):
    status, printed, _ = call("identify", lengths, "--out", tmp_path)
    assert status == 0
    assert printed.count(UNKNOWN) == 1
    base = json.loads((tmp_path / "identification.json").read_text())["base"]
    assert base["rotation_known"] is False
    assert base["std"] == [None] * 6


def test_a_model_file_remembers_it_and_an_old_one_is_taken_as_before(model, tmp_path):
    document = yaml.safe_load(model.read_text())
    assert document.pop("base_rotation_known") is False
    assert not read_model(model).base_rotation_known
    old = tmp_path / "old.yaml"
    old.write_text(yaml.safe_dump(document))
    assert read_model(old).base_rotation_known


def test_a_prediction_states_no_uncertainty_and_says_why(measured, model, call, tmp_path):
    out = tmp_path / "out.csv"
    poses = joints_csv(tmp_path / "q.csv", joints(measured))
    command = ("predict", model, poses, "--out", out, "--orientation-of", "flange")
    status, _, said = call(*command)
    assert status == 0
    assert said.count(UNKNOWN) == said.count("\n") == 1
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert {row[name] for row in rows for name in STD} == {""}
    found = np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows]) * 1e-3
    far = np.linalg.norm(measured.true.poses(joints(measured))[:, :3, 3] - ANCHOR, axis=1)
    # Only the lengths are right; 112 of 0.02 mm noise.
    assert np.linalg.norm(found - ANCHOR, axis=1) == pytest.approx(far, abs=2e-4)


def test_a_stated_base_turns_the_places_as_they_are(measured, lengths, call, tmp_path):
    state_base(lengths, measured)
    status, printed, _ = call("identify", lengths, "--out", tmp_path / "found")
    assert status == 0
    assert UNKNOWN not in printed
    out = tmp_path / "out.csv"
    poses = joints_csv(tmp_path / "q.csv", joints(measured))
    command = ("predict", tmp_path / "found" / "model.yaml", poses, "--out", out)
    assert UNKNOWN not in call(*command)[2]
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert all(float(row[name]) > 0 for row in rows for name in STD)
    found = np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows]) * 1e-3
    away = np.linalg.norm(found - measured.true.poses(joints(measured))[:, :3, 3], axis=1)
    # Base and joints 1 and 2 stand 1 mrad off each other's axes, over 2 m from the anchor.
    assert away.max() < 1e-2


@pytest.mark.parametrize(("frame", "warned"), [("measuring", True), ("base", False)])
def test_targets_in_the_measuring_frame_are_warned_of(
    measured, model, call, tmp_path, frame, warned
):
    poses = joints_csv(tmp_path / "q.csv", joints(measured))
    call("predict", model, poses, "--out", tmp_path / "targets.csv")
    command = ("compensate", model, tmp_path / "targets.csv", "--out", tmp_path / "out.csv")
    said = call(*command, "--frame", frame)[2]
    assert (UNKNOWN in said) == warned


def test_uncertainty_says_that_it_leaves_the_turn_aside(lengths, call, tmp_path):
    quick = ("--draws", 1000, "--refits", 0)
    status, printed, _ = call("uncertainty", lengths, "--out", tmp_path, *quick)
    assert status == 0
    assert UNKNOWN in printed
    document = json.loads((tmp_path / "uncertainty.json").read_text())
    assert document["base_rotation"]["known"] is False
    assert UNKNOWN in document["base_rotation"]["sentence"]


def test_a_new_station_seen_by_lengths_alone_says_so(lengths, model, call, tmp_path):
    status, printed, _ = call("station", model, lengths, "--out", tmp_path / "there")
    assert status == 0
    assert UNKNOWN in printed
    assert not read_model(tmp_path / "there" / "model.yaml").base_rotation_known


def test_rest_refuses_poses_in_the_cells_frame_and_takes_those_in_the_base(client, cell, database):
    arm = calibrated_arm("ur10e")
    content = content_of(arm)
    content.model["base_rotation_known"] = False
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    with database.write() as session:
        store.add_candidate(session, "c1", 1, content)
    q = np.deg2rad([[20, -80, 95, -100, -85, 10]])
    (wanted,) = np.linalg.inv(arm.true.base) @ arm.true.poses(q)
    quaternion = Rotation.from_matrix(wanted[:3, :3]).as_quat(scalar_first=True)
    poses = [{"xyz_mm": (1e3 * wanted[:3, 3]).tolist(), "quaternion": quaternion.tolist()}]
    refused = client.post("cells/c1/compensate?version=1", json={"poses": poses})
    assert refused.status_code == 422
    assert UNKNOWN in refused.json()["detail"]
    assert '"frame": "base"' in refused.json()["detail"]
    body = {"poses": poses, "frame": "base"}
    assert client.post("cells/c1/compensate?version=1", json=body).json()["reached"] == 1
