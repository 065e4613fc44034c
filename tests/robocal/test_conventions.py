"""One arm described in Craig's convention and in URDF, against an oracle for each."""

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from robocal.formats.robot_yaml import read_robot, robot_document
from robocal.kinematics.forward import forward_kinematics
from tests.elementary_kinematics import arm_from_document, frame, shift, turn

HALF = np.pi / 2
# A UR5e-like arm in Craig's order: alpha and a of the link before, then theta and d of the joint.
CRAIG = [
    ("revolute", 0.0, 0.0, 0.0, 162.5),
    ("revolute", 90.0, 0.0, 0.0, 0.0),
    ("revolute", 0.0, -425.0, 0.0, 0.0),
    ("revolute", 0.0, -392.2, 0.0, 133.3),
    ("revolute", 90.0, 0.0, 0.0, 99.7),
    ("revolute", -90.0, 0.0, 0.0, 99.6),
]
SCARA = [
    ("revolute", 0.0, 10.0, 30.0, 220.0),
    ("revolute", 0.4, 300.0, -20.0, 5.0),
    ("prismatic", 180.0, 250.0, 15.0, 40.0),
    ("revolute", 0.0, 0.0, 60.0, 0.0),
]
URDF = """<?xml version="1.0"?>
<robot name="ur-like">
  <link name="world"/><link name="base"/><link name="l1"/><link name="l2"/><link name="l3"/>
  <link name="l4"/><link name="l5"/><link name="l6"/><link name="tool0"/><link name="camera"/>
  <joint name="fixed_base" type="fixed">
    <parent link="world"/><child link="base"/><origin xyz="0.1 -0.2 0.3" rpy="0.1 0.2 0.3"/>
  </joint>
  <joint name="pan" type="revolute"><parent link="base"/><child link="l1"/>
    <origin xyz="0 0 0.1625" rpy="0 0 0"/><axis xyz="0 0 1"/>
    <limit lower="-6.28" upper="6.28" effort="1" velocity="1"/></joint>
  <joint name="lift" type="revolute"><parent link="l1"/><child link="l2"/>
    <origin xyz="0 0.138 0" rpy="0 {half} 0"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="elbow" type="revolute"><parent link="l2"/><child link="l3"/>
    <origin xyz="0 -0.131 0.425" rpy="0 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="l3"/><child link="l4"/>
    <origin xyz="0 0 0.392" rpy="0 {half} 0"/><axis xyz="0.6 0 -0.8"/>
    <limit lower="-0.2" upper="0.3" effort="1" velocity="1"/></joint>
  <joint name="wrist" type="continuous"><parent link="l4"/><child link="l5"/>
    <origin xyz="0 0.127 0" rpy="0.3 0 -0.1"/><axis xyz="0 0 -1"/></joint>
  <joint name="roll" type="revolute"><parent link="l5"/><child link="l6"/>
    <origin xyz="0 0 0.0997" rpy="0 0 0"/>
    <limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
  <joint name="flange" type="fixed"><parent link="l6"/><child link="tool0"/>
    <origin xyz="0 0.0996 0" rpy="0 0 {half}"/></joint>
  <joint name="camera_mount" type="fixed"><parent link="l3"/><child link="camera"/></joint>
</robot>
"""


def craig_yaml(rows) -> str:
    joints = "".join(
        f"  - {{type: {kind}, alpha_deg: {alpha}, a_mm: {a}, theta_deg: {theta}, d_mm: {d}}}\n"
        for kind, alpha, a, theta, d in rows
    )
    return f"name: arm\nconvention: craig\njoints:\n{joints}"


def craig_poses(rows, q: np.ndarray) -> np.ndarray:
    """Rx(alpha) Tx(a) Rz(theta) Tz(d), joint by joint."""
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for (kind, alpha, a, theta, d), reading in zip(rows, q.T, strict=True):
        slides = kind == "prismatic"
        T = T @ turn("x", np.deg2rad(alpha)) @ shift("x", a / 1e3)
        T = T @ turn("z", np.deg2rad(theta) + (0 if slides else reading) * np.ones(len(q)))
        T = T @ shift("z", d / 1e3 + (reading if slides else 0) * np.ones(len(q)))
    return T


def about(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Rodrigues' rotation."""
    K = np.cross(np.eye(3), axis)  # rows e_i x axis: the matrix of axis x, being skew
    T = np.broadcast_to(np.eye(4), (len(angle), 4, 4)).copy()
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    T[:, :3, :3] += s * K + (1 - c) * (K @ K)
    return T


def urdf_poses(text: str, q: np.ndarray) -> np.ndarray:
    """The chain to tool0, by the URDF specification: origin first, then the motion."""
    joints = {
        joint.find("child").get("link"): joint
        for joint in ElementTree.fromstring(text).iter("joint")
    }
    chain, link = [], "tool0"
    while link in joints:
        chain.insert(0, joints[link])
        link = joints[link].find("parent").get("link")
    T, column = np.broadcast_to(np.eye(4), (len(q), 4, 4)), 0
    for joint in chain:
        origin = joint.find("origin")
        xyz, rpy = (np.array(origin.get(name).split(), dtype=float) for name in ("xyz", "rpy"))
        T = T @ frame([*xyz, *rpy[::-1]])
        if joint.get("type") == "fixed":
            continue
        given = joint.find("axis")
        axis = np.array((1, 0, 0) if given is None else given.get("xyz").split(), dtype=float)
        if joint.get("type") == "prismatic":
            moved = np.broadcast_to(np.eye(4), T.shape).copy()
            moved[:, :3, 3] = q[:, column, None] * axis
        else:
            moved = about(axis, q[:, column])
        T, column = T @ moved, column + 1
    return T


def write_urdf(folder: Path, text: str) -> Path:
    (folder / "arm.urdf").write_text(text)
    (folder / "robot.yaml").write_text("name: arm\nconvention: urdf\nurdf: arm.urdf\n")
    return folder / "robot.yaml"


def draw(count: int, joints: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(-3, 3, (count, joints))


@pytest.mark.parametrize("rows", [CRAIG, SCARA], ids=["six-axis", "scara"])
def test_a_craig_table_means_what_craig_wrote(tmp_path, rows):
    path = tmp_path / "robot.yaml"
    path.write_text(craig_yaml(rows))
    q = draw(200, len(rows))
    poses = forward_kinematics(read_robot(path).geometry, q)
    np.testing.assert_allclose(poses, craig_poses(rows, q), atol=1e-13)


def test_a_urdf_chain_means_what_its_specification_says(tmp_path):
    text = URDF.format(half=HALF)
    robot = read_robot(write_urdf(tmp_path, text))
    q = draw(200, 6)
    poses = forward_kinematics(robot.geometry, q)
    np.testing.assert_allclose(poses, urdf_poses(text, q), atol=1e-13)
    assert robot.geometry.prismatic.tolist() == [False, False, False, True, False, False]
    np.testing.assert_allclose(robot.limits[3], [-0.2, 0.3])


def test_craig_and_urdf_and_mdh_agree_on_the_same_arm(tmp_path):
    """UR5e: URDF origins that are Craig's links, and the project's own MDH table."""
    links = "".join(
        f'<joint name="j{i}" type="continuous"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="{x} {y} {z}" rpy="{roll} 0 0"/><axis xyz="0 0 1"/></joint>'
        for i, (x, y, z, roll) in enumerate([
            (0, 0, 0.1625, 0), (0, 0, 0, HALF), (-0.425, 0, 0, 0),
            (-0.3922, 0, 0.1333, 0), (0, -0.0997, 0, HALF), (0, 0.0996, 0, -HALF),
        ])
    )  # fmt: skip
    urdf = read_robot(write_urdf(tmp_path, f'<robot name="ur5e">{links}</robot>'))
    (tmp_path / "craig.yaml").write_text(craig_yaml(CRAIG))
    craig = read_robot(tmp_path / "craig.yaml")
    q = draw(100, 6)
    poses = forward_kinematics(urdf.geometry, q)
    np.testing.assert_allclose(poses, forward_kinematics(craig.geometry, q), atol=1e-13)
    np.testing.assert_allclose(poses, craig_poses(CRAIG, q), atol=1e-13)


@pytest.mark.parametrize("half", ["1.5708", "1.570796325", "1.5707963", "1.58"])
def test_axes_that_are_parallel_but_for_rounding_do_not_run_off(tmp_path, half):
    """Common normals of nearly parallel axes lie far away; links must not follow them there."""
    text = URDF.format(half=half).replace(
        '<origin xyz="0 -0.131 0.425" rpy="0 0 0"/>',
        f'<origin xyz="0 -0.131 0.425" rpy="{float(half) - HALF} 0 1e-9"/>',
    )
    robot = read_robot(write_urdf(tmp_path, text))
    q = draw(200, 6)
    np.testing.assert_allclose(
        forward_kinematics(robot.geometry, q), urdf_poses(text, q), atol=1e-13
    )
    assert np.abs(robot.geometry.links[:, 1:3]).max() < 2.0


def test_a_robot_from_urdf_is_the_same_robot_in_its_own_file(tmp_path):
    text = URDF.format(half=HALF)
    robot = read_robot(write_urdf(tmp_path, text))
    document = robot_document(robot)
    arm = arm_from_document(document)
    six = {
        name: frame([
            *np.array(document[name]["xyz_mm"]) / 1e3,
            *np.deg2rad(document[name]["ypr_deg"]),
        ])
        for name in ("mount", "flange")
    }
    q = draw(50, 6)
    poses = arm.within(six["mount"], six["flange"]).poses(q)
    np.testing.assert_allclose(poses, urdf_poses(text, q), atol=1e-12)
