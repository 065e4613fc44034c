"""Every written file means what its format's specification says, read by a program of its own."""

import csv
import json
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from robocal.errors import BadInput, NoAnswer
from robocal.formats.formats import WRITERS
from robocal.formats.model_export import Difference, ExportOptions, write_export
from robocal.formats.model_yaml import write_model
from tests.elementary_kinematics import ROBOT_NAMES, Arm, frame, shift, turn
from tests.robocal.formats.calibrated_arms import calibrated_arm, largest_difference

HASH = "calib_14698139022496758595"
OPTIONS = ExportOptions(hash=HASH, euler="xyz")
SIX_REVOLUTE = ("abb_irb120", "staubli_tx60", "ur10e", "ur5")
TOLERANCE = 1e-12
"""Rounding of a few hundred multiplications; the promise is 1e-9 m."""


def export(tmp_path, arm, file_format, options=OPTIONS):
    path = tmp_path / "exported"
    difference = write_export(path, WRITERS[file_format](arm.calibrated, options))
    assert difference.poses == 1000
    assert difference.position <= 1e-9
    assert not list(tmp_path.glob("*.part"))
    return path.read_text()


def urdf_poses(text, q):
    """Origin, then the motion about or along z, in the order of the file; checks the chain."""
    T, column, parent = np.broadcast_to(np.eye(4), (len(q), 4, 4)), 0, "measuring_frame"
    for joint in ElementTree.fromstring(text).findall("joint"):
        assert joint.find("parent").get("link") == parent
        parent = joint.find("child").get("link")
        origin = joint.find("origin")
        xyz, rpy = (np.array(origin.get(name).split(), dtype=float) for name in ("xyz", "rpy"))
        step = np.eye(4)
        step[:3, :3], step[:3, 3] = Rotation.from_euler("xyz", rpy).as_matrix(), xyz
        T = T @ step
        if joint.get("type") == "fixed":
            continue
        assert joint.find("axis").get("xyz") == "0 0 1"
        slides = joint.get("type") == "prismatic"
        T = T @ (shift("z", q[:, column]) if slides else turn("z", q[:, column]))
        column += 1
    assert column == q.shape[1]
    return T


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_urdf_holds_base_links_and_tool(tmp_path, name):
    arm = calibrated_arm(name)
    q = arm.true.draw(np.random.default_rng(2), 100)
    found = urdf_poses(export(tmp_path, arm, "urdf"), q)
    assert largest_difference(arm.true.poses(q), found) < TOLERANCE


@pytest.mark.parametrize("name", SIX_REVOLUTE)
def test_ur_kinematics_hold_base_to_wrist_with_true_urdf_angles(tmp_path, name):
    arm = calibrated_arm(name)
    document = yaml.safe_load(export(tmp_path, arm, "ur-kinematics"))["kinematics"]
    assert document.pop("hash") == HASH
    assert list(document) == ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"]
    q = arm.true.draw(np.random.default_rng(2), 100)
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for link, reading in zip(document.values(), q.T, strict=True):
        step = np.eye(4)
        rpy = [link["roll"], link["pitch"], link["yaw"]]
        step[:3, :3] = Rotation.from_euler("xyz", rpy).as_matrix()
        step[:3, 3] = [link["x"], link["y"], link["z"]]
        T = T @ step @ turn("z", reading)
    _, _, a, alpha, beta = arm.true.links[-1]
    behind = shift("x", a) @ turn("x", alpha) @ turn("y", beta)
    found = arm.true.base @ T @ behind @ arm.true.tool
    assert largest_difference(arm.true.poses(q), found) < TOLERANCE


def test_ur_kinematics_say_which_tcp_completes_them(tmp_path):
    arm = calibrated_arm("ur10e")
    _, _, a, alpha, beta = arm.true.links[-1]
    tool = shift("x", a) @ turn("x", alpha) @ turn("y", beta) @ arm.true.tool
    sentence = WRITERS["ur-kinematics"](arm.calibrated, OPTIONS).left_out[0]
    assert f"set the TCP to x {tool[0, 3] * 1e3:.4f} y {tool[1, 3] * 1e3:.4f}" in sentence
    turned = Rotation.from_matrix(tool[:3, :3]).as_rotvec()
    assert f"rx {turned[0]:.7f} ry {turned[1]:.7f} rz {turned[2]:.7f}" in sentence


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_an_mdh_csv_multiplies_to_the_robot_row_by_row(tmp_path, name):
    arm = calibrated_arm(name)
    rows = list(csv.DictReader(export(tmp_path, arm, "mdh-csv").splitlines()))
    q = arm.true.draw(np.random.default_rng(2), 100)
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for row in rows:
        number = {name: float(cell) for name, cell in row.items() if name[-2:] in "mmeg" and cell}
        length = {name: value / 1e3 for name, value in number.items() if name.endswith("_mm")}
        angle = {name: np.radians(v) for name, v in number.items() if name.endswith("_deg")}
        if row["type"] == "frame":
            place = [length[f"{axis}_mm"] for axis in "xyz"]
            T = T @ frame([*place, *(angle[f"{part}_deg"] for part in ("yaw", "pitch", "roll"))])
            continue
        reading, slides = q[:, int(row["part"]) - 1], row["type"] == "prismatic"
        T = T @ turn("z", angle["theta_deg"] + (0 * reading if slides else reading))
        T = T @ shift("z", length["d_mm"] + (reading if slides else 0 * reading))
        T = T @ shift("x", length["a_mm"]) @ turn("x", angle["alpha_deg"])
        T = T @ turn("y", angle["beta_deg"])
    assert largest_difference(arm.true.poses(q), T) < TOLERANCE


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_an_mdh_json_names_the_same_numbers(tmp_path, name):
    arm = calibrated_arm(name)
    document = json.loads(export(tmp_path, arm, "mdh-json"))
    deg = np.pi / 180
    names = {"theta_deg": deg, "d_mm": 1e-3, "a_mm": 1e-3, "alpha_deg": deg, "beta_deg": deg}
    links = np.array([
        [joint[name] * unit for name, unit in names.items()] for joint in document["joints"]
    ])
    np.testing.assert_allclose(links, arm.true.links, atol=1e-15)
    base, tool = (
        frame([*np.array(document[part]["xyz_mm"]) / 1e3, *np.radians(document[part]["ypr_deg"])])
        for part in ("base", "tool")
    )
    found = Arm(links, arm.true.prismatic, arm.true.limits, base, tool)
    q = arm.true.draw(np.random.default_rng(2), 20)
    assert largest_difference(arm.true.poses(q), found.poses(q)) < TOLERANCE


@pytest.mark.parametrize(("euler", "scipy_order"), [("zyx", "xyz"), ("xyz", "XYZ")])
def test_a_robodk_table_holds_poses_of_the_true_robot(tmp_path, euler, scipy_order):
    arm = calibrated_arm("abb_irb120")
    text = export(tmp_path, arm, "robodk", ExportOptions(euler=euler))
    values = np.array([row.split(",") for row in text.splitlines()[1:]], dtype=float)
    assert values.shape == (1000, 18)
    for columns, expected in (
        (values[:, 6:12], arm.true.poses(np.radians(values[:, :6]))),
        (values[:, 12:], np.repeat(arm.tool[None], 1000, axis=0)),
    ):
        found = np.broadcast_to(np.eye(4), (1000, 4, 4)).copy()
        angles = Rotation.from_euler(scipy_order, columns[:, 3:], degrees=True)
        found[:, :3, :3], found[:, :3, 3] = angles.as_matrix(), columns[:, :3] / 1e3
        assert largest_difference(expected, found) < TOLERANCE


@pytest.mark.parametrize("file_format", ["ur-kinematics", "robodk"])
def test_a_format_of_six_revolute_joints_refuses_a_scara(file_format):
    with pytest.raises(BadInput, match="six revolute joints"):
        WRITERS[file_format](calibrated_arm("abb_irb910sc").calibrated, OPTIONS)


@pytest.mark.parametrize("file_format", WRITERS)
def test_what_a_format_cannot_hold_is_said(file_format):
    export = WRITERS[file_format](calibrated_arm("ur5e").calibrated, OPTIONS)
    assert any("covariance" in sentence for sentence in export.left_out)


def test_pitch_next_to_a_right_angle_survives_the_trip(tmp_path):
    """alpha = beta = 1.570796327 puts yaw and roll on one line, where careless angles lose 1e-6."""
    arm = calibrated_arm("ur10e")
    links = arm.true.links.copy()
    links[1, 3:] = links[3, 3:] = 0.3, 1.570796327
    model = replace(arm.calibrated.model, links=links)
    bent = replace(arm, calibrated=replace(arm.calibrated, model=model))
    q = arm.true.draw(np.random.default_rng(2), 100)
    found = urdf_poses(export(tmp_path, bent, "urdf"), q)
    assert largest_difference(replace(arm.true, links=links).poses(q), found) < TOLERANCE


def test_a_file_that_reads_back_differently_is_not_written(tmp_path):
    made = WRITERS["urdf"](calibrated_arm("ur5e").calibrated, OPTIONS)
    path = tmp_path / "arm.urdf"
    with pytest.raises(NoAnswer, match="differ"):
        write_export(path, replace(made, difference=lambda _: Difference(1000, 2e-9, 0.0)))
    assert not list(tmp_path.iterdir())


def test_a_link_that_is_a_micrometre_off_is_seen_in_the_difference(tmp_path):
    made = WRITERS["urdf"](calibrated_arm("ur5e").calibrated, OPTIONS)
    root = ElementTree.fromstring(made.text)
    origin = root.find("joint[@name='joint_3']/origin")
    x, y, z = map(float, origin.get("xyz").split())
    origin.set("xyz", f"{x + 1e-6!r} {y!r} {z!r}")
    path = tmp_path / "tampered.urdf"
    path.write_bytes(ElementTree.tostring(root))
    difference = made.difference(path)
    assert difference.position == pytest.approx(1e-6, rel=1e-6)
    assert difference.angle < 1e-12


@pytest.mark.parametrize("given", [None, "14698139022496758595", "calib_x"])
def test_ur_kinematics_want_the_robots_own_hash(given):
    with pytest.raises(BadInput, match="--hash"):
        WRITERS["ur-kinematics"](calibrated_arm("ur5e").calibrated, ExportOptions(hash=given))


def test_the_command_keeps_the_hash_of_the_robots_own_file_and_prints_the_difference(
    tmp_path, call
):
    arm = calibrated_arm("ur5e")
    write_model(tmp_path / "model.yaml", arm.calibrated)
    own, out = tmp_path / "own.yaml", tmp_path / "new.yaml"
    own.write_text(export(tmp_path, calibrated_arm("ur5e", 2), "ur-kinematics"))
    command = ("export", tmp_path / "model.yaml", "--format", "ur-kinematics", "--out", out)
    status, printed, _ = call(*command, "--hash", own)
    assert status == 0
    assert yaml.safe_load(out.read_text())["kinematics"]["hash"] == HASH
    assert "largest difference" in printed
    assert "note: UR kinematics hold no tool" in printed
    status, printed, _ = call(*command, "--hash", HASH, "--json")
    assert json.loads(printed)["largest_position_m"] <= 1e-9
    status, _, complaint = call(*command)
    assert status == 2
    assert complaint.count("\n") == 1
    status, _, complaint = call(*command[:3], "dxf", *command[4:])
    assert (status, complaint.count("\n")) == (2, 1)
