"""Positions alone do not show how the tool is turned: every command says so, and none makes it up.

The true tool is turned at random, and nobody states it.
"""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from robocal.formats.bundle import read_bundle
from robocal.formats.model_yaml import model_document, read_model
from service.parameters import store
from tests.measured_cell import Cell, true_cell, write_bundle
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import content_of

ROBOT = "ur10e"
UNKNOWN = "how the tool is turned in the flange is not known"
GUESS = "tool_guess: {xyz_mm: [60, -40, 120], ypr_deg: [10, 20, 30]}\n"


@pytest.fixture(scope="module")
def positions(tmp_path_factory) -> tuple[Path, Cell]:
    """60 positions of one target on a tool."""
    folder = tmp_path_factory.mktemp("positions")
    cell = true_cell(ROBOT, 3)
    write_bundle(folder, ROBOT, cell, 60, 3, full_pose=False)
    return folder, cell


@pytest.fixture
def model(positions, call, tmp_path) -> Path:
    assert call("identify", positions[0], "--out", tmp_path / "found")[0] == 0
    return tmp_path / "found" / "model.yaml"


def joints_csv(path: Path, q: np.ndarray) -> Path:
    head = ",".join(f"j{joint}_deg" for joint in range(1, 7))
    path.write_text(
        "\n".join([head, *(",".join(map(repr, row)) for row in np.degrees(q).tolist())])
    )
    return path


def targets_csv(path: Path, T: np.ndarray, q: np.ndarray) -> Path:
    turned = Rotation.from_matrix(T[:, :3, :3]).as_quat(scalar_first=True)
    table = np.hstack([T[:, :3, 3] * 1e3, turned, np.degrees(q)])
    head = ["x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz", *(f"j{k}_deg" for k in range(1, 7))]
    rows = [",".join(map(repr, row)) for row in table.tolist()]
    path.write_text("\n".join([",".join(head), *rows]) + "\n")
    return path


def quaternions(path: Path) -> Rotation:
    rows = csv.DictReader(path.read_text().splitlines())
    table = [[float(row[name]) for name in ("qw", "qx", "qy", "qz")] for row in rows]
    return Rotation.from_quat(table, scalar_first=True)


def easy_joints(count: int) -> np.ndarray:
    """Away from singular poses [rad]."""
    middle = np.deg2rad([20, -80, 95, -100, -85, 10])
    return middle + np.random.default_rng(4).uniform(-0.3, 0.3, (count, 6))


def test_the_rotation_is_known_by_orientations_to_fit_or_by_a_statement(positions, tmp_path):
    bundle = read_bundle(positions[0])
    assert not bundle.tool_rotation_known
    assert replace(bundle, tool_guess=np.zeros(6)).tool_rotation_known
    write_bundle(tmp_path, ROBOT, positions[1], 20, full_pose=True)
    full = read_bundle(tmp_path)
    assert full.tool_rotation_known
    rows = full.measurements
    checked = replace(rows, orientation=np.where(rows.held_out[:, None], rows.orientation, np.nan))
    assert not replace(full, measurements=checked).tool_rotation_known
    on_nests = replace(rows, target=("n1",) * len(rows))
    assert not replace(full, measurements=on_nests).tool_rotation_known


def test_an_identification_gives_the_tools_angles_no_uncertainty(positions, call, tmp_path):
    status, printed, _ = call("identify", positions[0], "--out", tmp_path)
    assert status == 0
    assert UNKNOWN in printed
    tool = json.loads((tmp_path / "identification.json").read_text())["tool"]
    assert tool["rotation_known"] is False
    assert tool["std"][3:] == [None, None, None]
    assert all(0 < std < 1 for std in tool["std"][:3])


def test_a_model_file_remembers_it_and_an_old_one_is_taken_as_before(model, tmp_path):
    document = yaml.safe_load(model.read_text())
    assert document["tool_rotation_known"] is False
    assert not read_model(model).tool_rotation_known
    del document["tool_rotation_known"]
    old = tmp_path / "old.yaml"
    old.write_text(yaml.safe_dump(document))
    assert read_model(old).tool_rotation_known


def test_a_prediction_of_the_tools_orientation_leaves_it_empty_and_says_why(
    positions, model, call, tmp_path
):
    q = easy_joints(5)
    out = tmp_path / "out.csv"
    command = ("predict", model, joints_csv(tmp_path / "q.csv", q), "--out", out, "--json")
    status, printed, said = call(*command, "--orientation-of", "tool")
    assert status == 0
    assert said.count("\n") == 1
    assert UNKNOWN in said
    assert json.loads(printed)["rows_without_quaternion"] == 5
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert {row[name] for row in rows for name in ("qw", "qx", "qy", "qz")} == {""}
    found = np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows]) * 1e-3
    away = np.linalg.norm(found - positions[1].true.poses(q)[:, :3, 3], axis=1)
    # 0.02 mm of noise a coordinate and 45 rows.
    assert away.max() < 2e-4


@pytest.mark.parametrize("asked", [(), ("--orientation-of", "flange")])
def test_a_prediction_gives_the_flanges_orientation(positions, model, call, tmp_path, asked):
    q = easy_joints(5)
    out = tmp_path / "out.csv"
    command = ("predict", model, joints_csv(tmp_path / "q.csv", q), "--out", out)
    status, _, said = call(*command, *asked)
    assert status == 0
    # Who did not ask for it is told.
    assert (UNKNOWN in said) == (asked == ())
    flange = replace(positions[1].true, tool=np.eye(4)).poses(q)[:, :3, :3]
    turn = Rotation.from_matrix(flange).inv() * quaternions(out)
    # The last link's own angles are off nominal by 1 mrad each, and no position sees them.
    assert turn.magnitude().max() < 1e-2


def test_targets_of_the_tool_are_refused_with_what_to_do(positions, model, call, tmp_path):
    q = easy_joints(3)
    targets = targets_csv(tmp_path / "t.csv", positions[1].true.poses(q), q)
    out = tmp_path / "out.csv"
    asked = ("--orientation-of", "tool")
    status, _, said = call("compensate", model, targets, "--out", out, *asked)
    assert (status, said.count("\n")) == (2, 1)
    assert UNKNOWN in said
    for way in ("tool_guess", "full poses", "--orientation-of flange"):
        assert way in said
    assert not out.exists()


@pytest.mark.parametrize("asked", [(), ("--orientation-of", "flange")])
def test_targets_that_state_the_flanges_orientation_are_reached(
    positions, model, call, tmp_path, asked
):
    cell, q = positions[1], easy_joints(10)
    flange = replace(cell.true, tool=np.eye(4))
    wanted = flange.poses(q)
    wanted[:, :3, 3] = cell.true.poses(q)[:, :3, 3]
    targets = targets_csv(tmp_path / "t.csv", wanted, q)
    out = tmp_path / "out.csv"
    status, _, said = call("compensate", model, targets, "--out", out, *asked)
    assert (status, UNKNOWN in said) == (0, asked == ())
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert {row["status"] for row in rows} == {"reached"}
    found = np.radians([[float(row[f"j{k}_deg"]) for k in range(1, 7)] for row in rows])
    there = cell.true.poses(found)[:, :3, 3]
    assert np.linalg.norm(there - wanted[:, :3, 3], axis=1).max() < 2e-4
    # No position sees the last link's own angles, off nominal by 1 mrad each.
    turn = np.swapaxes(flange.poses(found)[:, :3, :3], 1, 2) @ wanted[:, :3, :3]
    assert np.linalg.norm(Rotation.from_matrix(turn).as_rotvec(), axis=1).max() < 1e-2


def test_uncertainty_states_places_and_no_turns(positions, call, tmp_path):
    status, printed, _ = call(
        "uncertainty", positions[0], "--out", tmp_path, "--draws", 1000, "--refits", 0
    )
    assert status == 0
    assert UNKNOWN in printed
    document = json.loads((tmp_path / "uncertainty.json").read_text())
    assert document["tool_rotation"]["known"] is False
    assert UNKNOWN in document["tool_rotation"]["sentence"]
    for pose in document["poses"]:
        assert pose["u_rotation_mrad"] is None
        assert 0 < pose["U95_mm"] < 1


@pytest.mark.parametrize("file_format", ["ur-kinematics", "urdf", "mdh-json"])
def test_an_export_says_that_the_tools_rotation_was_not_identified(
    model, call, tmp_path, file_format
):
    own = ("--hash", "calib_1") if file_format == "ur-kinematics" else ()
    command = ("export", model, "--format", file_format, "--out", tmp_path / "x", *own, "--json")
    status, printed, _ = call(*command)
    assert status == 0
    said = " ".join(json.loads(printed)["left_out"])
    assert UNKNOWN in said
    assert "rx 0" not in said


def test_a_stated_tool_is_used_and_nothing_is_said(positions, call, tmp_path):
    """The statement's quaternion, on the flange of the identified arm."""
    folder = tmp_path / "stated"
    write_bundle(folder, ROBOT, positions[1], 60, 3, full_pose=False)
    campaign = folder / "campaign.yaml"
    campaign.write_text(campaign.read_text() + GUESS)
    assert UNKNOWN not in call("identify", folder, "--out", tmp_path)[1]
    q = easy_joints(4)
    out = tmp_path / "out.csv"
    command = ("predict", tmp_path / "model.yaml", joints_csv(tmp_path / "q.csv", q), "--out", out)
    status, _, said = call(*command)
    assert (status, said) == (0, "")
    flange = replace(positions[1].true, tool=np.eye(4)).poses(q)[:, :3, :3]
    stated = Rotation.from_matrix(flange) * Rotation.from_euler("ZYX", [10, 20, 30], degrees=True)
    # The last link's own angles are off nominal by 1 mrad each, and no position sees them.
    assert (stated.inv() * quaternions(out)).magnitude().max() < 1e-2


def test_rest_refuses_poses_of_such_a_tool_in_one_sentence_and_takes_the_flanges(
    client, cell, database
):
    arm = calibrated_arm(ROBOT)
    content = content_of(arm)
    content.model["tool_rotation_known"] = False
    assert model_document(arm.calibrated)["tool_rotation_known"] is True
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    with database.write() as session:
        store.add_candidate(session, "c1", 1, content)
    tool_poses = arm.true.poses(easy_joints(4))
    flange = tool_poses @ np.linalg.inv(arm.tool)
    wanted = flange.copy()
    wanted[:, :3, 3] = tool_poses[:, :3, 3]
    quaternion = Rotation.from_matrix(wanted[:, :3, :3]).as_quat(scalar_first=True)
    poses = [
        {"xyz_mm": (1e3 * pose[:3, 3]).tolist(), "quaternion": turned.tolist()}
        for pose, turned in zip(wanted, quaternion, strict=True)
    ]
    body = {"poses": poses, "orientation_of": "tool"}
    refused = client.post("cells/c1/compensate?version=1", json=body)
    assert refused.status_code == 422
    assert UNKNOWN in refused.json()["detail"]
    assert '"orientation_of": "flange"' in refused.json()["detail"]
    found = client.post("cells/c1/compensate?version=1", json={"poses": poses}).json()
    assert (found["reached"], found["orientation_of"]) == (4, "flange")
    there = arm.true.poses(np.deg2rad(found["joints_deg"]))
    assert np.abs(there - tool_poses).max() < 1e-6
