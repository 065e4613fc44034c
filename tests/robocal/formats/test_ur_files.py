"""UR's kinematics YAML and calibration.conf, against numbers of real controllers."""

import json

import numpy as np
import pytest
import yaml

from robocal.errors import BadInput
from robocal.formats.joint_origins import frame_from_xyz_rpy
from robocal.formats.robot_import import RobotOptions
from robocal.formats.ur_calibration_conf import read_calibration_conf
from robocal.formats.ur_kinematics import read_ur_kinematics
from robocal.kinematics.forward import forward_kinematics
from robocal.robots.library import load_robot
from tests.elementary_kinematics import load_arm, shift, turn

# Universal_Robots_ROS2_Driver, ur_calibration/test/calibration_test.cpp: factory deltas of three
# UR10, as d, a, theta, alpha.
REAL_DELTAS = {
    "metres": (
        [0.00065609212979853, 1.4442162376284788, 0.854147723854608, -2.2989425877563705,
         -1.573498686836816e-05, 1.9072435590711256e-05],
        [4.6311376834935676e-05, -0.00012568315331862312, 0.00186216581161458,
         9.918593870679266e-05, 4.215462720453189e-06, 0],
        [-7.290070070824746e-05, -0.01713897289704999, -0.03707159413492756, 0.054279462160583214,
         1.488984257025741e-07, 1.551499479707493e-05],
        [0.000211987863869334, -0.0072553625957652995, -0.013483226769541364,
         0.0013495820227329425, -0.001263136163679901, 0],
    ),
    "hundreds of metres": (
        [-0.000144894975118076141, 303.469135666158195, -309.88394307789747, 6.41459904397394975,
         -4.48232900190081995e-05, -0.00087071402790364627],
        [0.000108651068627930392, 0.240324175250532346, 0.00180628180213493472,
         2.63076149165684402e-05, 3.96638632500012715e-06, 0],
        [1.59613525316931737e-07, -0.917209621528830232, 7.12936131346499469, 0.0710299029424392298,
         -1.64258976526054923e-06, 9.17286101034808787e-08],
        [-0.000444781952841921679, -0.00160215112531214153, 0.00631917793331091861,
         -0.00165055247340828437, 0.000763682515545038854, 0],
    ),
    "440 metres": (
        [-0.000160188285741325043, 439.140974079900957, -446.027059806332147, 6.88618689642360149,
         -3.86588496858186748e-05, -0.00087908274257374186],
        [2.12234865571205891e-05, 0.632017132627700651, 0.00229833638891230319,
         -4.61409023720933908e-05, -6.39280053471801522e-05, 0],
        [-2.41478068943590252e-07, 1.60233952386694556, -1.68607190752171299,
         0.0837331147700118711, -1.01260355871157781e-07, 3.91986209186123702e-08],
        [-0.000650246557584166496, 0.00139416666825590402, 0.00693818880325995126,
         -0.000811641562390219562, 0.000411120504570705592, 0],
    ),
}  # fmt: skip

# The same file: positions that a simulated UR10 controller reported; its pi/2 is 1.570796327.
CONTROLLER_POSES = (
    ([-1.6007002035724084976, -1.7271001974688928726, -2.2029998938189905288,
      -0.80799991289247685700, 1.59510004520416259765, -0.03099996248354131012],
     [-0.179925914147547, -0.606869755162764, 0.230789102067257]),
    ([1.32645022869110107421, 2.426007747650146484375, 5.951572895050048828125,
      1.27409040927886962890, -0.54105216661562138824, 0.122173048555850982666],
     [0.39922988003280424074, 0.59688365069340565405, -0.66778190402763750614]),
)  # fmt: skip
ROUNDED_ALPHA = [1.570796327 - np.pi / 2, 0, 0, 1.570796327 - np.pi / 2, np.pi / 2 - 1.570796327, 0]

# Universal_Robots_ROS_Driver, issue 457: one robot's Denavit-Hartenberg table as its controller
# gives it, and what ur_calibration made of the first two joints.
ISSUE_457 = {
    "theta": [-9.62699668632896e-06, -1.43707039992005, 2.02543119975016, -0.588254688694989,
              4.13647390228702e-05, 8.1737464953645e-06],
    "a": [0.000279332356195598, -0.0566854832098269, -0.32646702272051, 1.49388687216263e-05,
          2.23692592990586e-07, 0],
    "d": [0.0888794492754001, 574.241384579456, -507.363402098168, -66.7676839353205,
          0.0949734691141216, 0.0825625014554953],
    "alpha": [1.57033858830411, -0.000733893428160216, 0.00325607356326439, 1.57040005185553,
              -1.57101000328584, 0],
}  # fmt: skip


def conf(tmp_path, d, a, theta, alpha, more=""):
    lists = {"theta": theta, "a": a, "d": d, "alpha": alpha}
    lines = [f"delta_{name} = {json.dumps(list(map(float, six)))}" for name, six in lists.items()]
    path = tmp_path / "calibration.conf"
    path.write_text("\n".join(["[mounting]", *lines, more]) + "\n")
    return path


def dh_poses(theta, d, a, alpha, q):
    """Rz(theta + q) Tz(d) Tx(a) Rx(alpha), multiplied as it stands, hundreds of metres and all."""
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for joint in range(6):
        T = T @ turn("z", theta[joint] + q[:, joint]) @ shift("z", d[joint])
        T = T @ shift("x", a[joint]) @ turn("x", alpha[joint])
    return T


@pytest.mark.parametrize("deltas", REAL_DELTAS.values(), ids=REAL_DELTAS)
def test_a_factory_calibration_keeps_its_poses_and_loses_its_hundreds_of_metres(tmp_path, deltas):
    read = read_calibration_conf(
        conf(tmp_path, *deltas), RobotOptions(nominal=load_robot("ur10"))
    ).robot
    nominal = load_arm("ur10").links
    d, a, theta, alpha = (np.array(six) for six in deltas)
    q = np.random.default_rng(1).uniform(-2 * np.pi, 2 * np.pi, (1000, 6))
    expected = dh_poses(
        nominal[:, 0] + theta, nominal[:, 1] + d, nominal[:, 2] + a, nominal[:, 3] + alpha, q
    )
    # 440 m times the rounding of a sine leaves 1e-13 m in the expectation itself.
    np.testing.assert_allclose(forward_kinematics(read.geometry, q), expected, atol=2e-12)
    near = np.abs(read.geometry.links - nominal)
    assert near[:, [1, 2]].max() < 0.01
    assert near[:, [0, 3, 4]].max() < 0.03


def test_the_controllers_own_poses_come_out(tmp_path):
    zero = np.zeros(6)
    path = conf(tmp_path, zero, zero, zero, ROUNDED_ALPHA)
    robot = read_calibration_conf(path, RobotOptions(nominal=load_robot("ur10"))).robot
    q, position = (np.array(part) for part in zip(*CONTROLLER_POSES, strict=True))
    found = forward_kinematics(robot.geometry, q)[:, :3, 3]
    np.testing.assert_allclose(found, position, atol=1e-14)


def test_one_real_robot_agrees_with_what_ur_calibration_made_of_it(tmp_path):
    nominal = load_arm("ur5").links
    columns = {"theta": 0, "d": 1, "a": 2, "alpha": 3}
    deltas = {name: np.array(ISSUE_457[name]) - nominal[:, k] for name, k in columns.items()}
    path = conf(tmp_path, **deltas)
    links = read_calibration_conf(
        path, RobotOptions(nominal=load_robot("ur5"))
    ).robot.geometry.links
    np.testing.assert_allclose(links[0, 1], 0.08887944927540013, atol=1e-15)
    np.testing.assert_allclose(links[0, 0], -9.626996686328957e-06, atol=1e-12)
    np.testing.assert_allclose(
        links[0, 2:4], [0.0002793323561955981, 1.570338588304109], atol=1e-15
    )
    np.testing.assert_allclose(links[1, 0], 2.1588e-5, atol=1e-9)


def test_deltas_of_another_robot_type_are_refused(tmp_path):
    path = conf(tmp_path, *REAL_DELTAS["440 metres"])
    with pytest.raises(BadInput, match="another robot type"):
        read_calibration_conf(path, RobotOptions(nominal=load_robot("ur5")))


def test_the_calibration_status_is_told(tmp_path):
    path = conf(tmp_path, *REAL_DELTAS["metres"], more="calibration_status = 1 # 0 == notInit")
    read = read_calibration_conf(path, RobotOptions(nominal=load_robot("ur10")))
    assert "calibration_status 1 (notLinearised)" in read.notes


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (lambda text: text.replace("[mounting]", "[x]"), r"no section \[mounting\]"),
        (lambda text: text.replace("delta_d", "delta_e"), "'delta_d' is missing"),
        (lambda text: text.replace("delta_d = [", "delta_d = [1, "), "line 4.*six numbers"),
        (lambda text: text.replace("delta_d = [", "delta_d = [x"), "line 4.*six numbers"),
        (lambda text: text.replace("delta_d = [", "delta_d = [nan, 1#"), "line 4.*six numbers"),
        (lambda text: text + "delta_a = [0, 0, 0, 0, 0, 0]\n", "line 7.*twice"),
    ],
)
def test_a_spoilt_calibration_conf_is_named_with_its_line(tmp_path, spoil, complaint):
    path = conf(tmp_path, *REAL_DELTAS["metres"])
    path.write_text(spoil(path.read_text()))
    with pytest.raises(BadInput, match=complaint):
        read_calibration_conf(path, RobotOptions(nominal=load_robot("ur10")))


@pytest.mark.parametrize("robot", [None, "staubli_tx60", "abb_irb910sc"])
def test_a_calibration_conf_wants_its_ur(tmp_path, robot):
    nominal = robot and load_robot(robot)
    with pytest.raises(BadInput):
        read_calibration_conf(conf(tmp_path, *REAL_DELTAS["metres"]), RobotOptions(nominal=nominal))


# ur_description, config/ur10e/default_kinematics.yaml
UR10E = {
    "shoulder": (0, 0, 0.1807, 0, 0, 0),
    "upper_arm": (0, 0, 0, 1.570796327, 0, 0),
    "forearm": (-0.6127, 0, 0, 0, 0, 0),
    "wrist_1": (-0.57155, 0, 0.17415, 0, 0, 0),
    "wrist_2": (0, -0.11985, -2.458164590756244e-11, 1.570796327, 0, 0),
    "wrist_3": (0, 0.11655, -2.390480459346185e-11, 1.570796326589793, np.pi, np.pi),
}

# A calibrated UR5 as ur_calibration wrote it; wrist_1 turns by 180 degrees three times.
UR5 = {
    "shoulder": (0, 0, 0.089459, 0, 0, 1.5413963267648517e-05),
    "upper_arm": (8.28481932000539e-05, 0, 0, 1.5702793305568989, 0, 9.4248239648454113e-05),
    "forearm": (-0.42514603197027351, 0, 0, 0.00027727163297603633, 0.00074181659174685764,
                8.2061777589927939e-05),
    "wrist_1": (-0.39231335412023205, 0.00070367842866065884, 0.11004902881674888,
                3.1351985141209435, -3.1400954402443415, 3.1415185610293745),
    "wrist_2": (3.6501405590628345e-05, -0.094721186124807052, 0.0001791428279527357,
                1.5689050644312028, 0, -1.320607040336194e-05),
    "wrist_3": (0.00015399008043081661, 0.082421327089370319, 0.00012632686207930083,
                1.5723290218826846, 3.1415926535897931, -3.14158677108863),
}  # fmt: skip


def kinematics_yaml(tmp_path, links):
    names = ("x", "y", "z", "roll", "pitch", "yaw")
    document = {link: dict(zip(names, values, strict=True)) for link, values in links.items()}
    path = tmp_path / "kinematics.yaml"
    path.write_text(yaml.safe_dump({"kinematics": {**document, "hash": "calib_1"}}))
    return path


def test_the_makers_default_file_gives_the_makers_table(tmp_path):
    read = read_ur_kinematics(kinematics_yaml(tmp_path, UR10E), RobotOptions()).robot.geometry
    # The file rounds pi/2 to nine digits.
    np.testing.assert_allclose(read.links, load_arm("ur10e").links, atol=1e-9)
    np.testing.assert_array_equal(read.mount, np.eye(4))
    np.testing.assert_array_equal(read.flange, np.eye(4))


@pytest.mark.parametrize("euler", [None, "zyx", "xyz"])
def test_a_calibrated_file_is_read_in_the_order_that_is_asked_for(tmp_path, euler):
    path = kinematics_yaml(tmp_path, UR5)
    robot = read_ur_kinematics(path, RobotOptions(euler=euler)).robot
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (200, 6))
    T = np.broadcast_to(np.eye(4), (len(q), 4, 4))
    for (x, y, z, roll, pitch, yaw), reading in zip(UR5.values(), q.T, strict=True):
        turns = [turn("x", roll), turn("y", pitch), turn("z", yaw)]
        step = np.linalg.multi_dot(turns if euler == "xyz" else turns[::-1])
        step[:3, 3] = x, y, z
        T = T @ step @ turn("z", reading)
    np.testing.assert_allclose(forward_kinematics(robot.geometry, q), T, atol=1e-13)
    # A UR5 whatever the order: the links stay near the maker's table.
    assert np.abs(robot.geometry.links - load_arm("ur5").links).max() < 0.01


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (lambda text: text.replace("yaw", "jaw", 1), "is missing"),
        (lambda text: text.replace("  wrist_3:", "  wrist_4:"), "wrist_3' is missing"),
        (lambda text: text.replace("  hash: calib_1\n", ""), "hash' is missing"),
        (
            lambda text: text.replace("0.42514603197027351", "1e"),
            "line 5.*forearm.x.*must be a number",
        ),
        (lambda text: text + "other: 1\n", "not known"),
    ],
)
def test_a_spoilt_kinematics_file_is_named_with_its_line(tmp_path, spoil, complaint):
    path = kinematics_yaml(tmp_path, UR5)
    path.write_text(spoil(path.read_text().replace("0.4251460319702735", "0.42514603197027351")))
    with pytest.raises(BadInput, match=complaint):
        read_ur_kinematics(path, RobotOptions())


def test_the_command_writes_a_robot_that_other_commands_take(tmp_path, call):
    out = tmp_path / "robot"
    path = kinematics_yaml(tmp_path, UR5)
    status, printed, _ = call("convert", path, "--format", "ur-kinematics", "--out", out)
    assert status == 0
    assert "largest difference" in printed
    assert "calib_1" in printed
    conf_path = conf(tmp_path, *REAL_DELTAS["metres"])
    command = ("convert", conf_path, "--format", "ur-calibration", "--out", out)
    assert call(*command, "--robot", "ur10", "--name", "number 7")[0] == 0
    assert yaml.safe_load((out / "robot.yaml").read_text())["name"] == "number 7"
    assert call(*command)[0] == 2


def test_angles_next_to_a_right_angle_give_back_the_rotation():
    rng = np.random.default_rng(1)
    for pitch in (np.pi / 2, 1.570796327, 1.5707, -np.pi / 2 + 1e-12):
        for _ in range(20):
            x, z = rng.uniform(-np.pi, np.pi, 2)
            T = frame_from_xyz_rpy(np.zeros(3), np.array([x, pitch, z]))
            expected = turn("z", z) @ turn("y", pitch) @ turn("x", x)
            np.testing.assert_allclose(T, expected, atol=1e-15)
