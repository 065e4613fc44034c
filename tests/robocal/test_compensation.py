"""Compensated joints bring the true robot to the wanted pose; what cannot be reached is named."""

import csv
import json
import time
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robocal.compensation import compensate, compensate_targets
from robocal.formats.model_yaml import write_model
from robocal.missed_targets import missed_sentence
from robocal.reach import Reach
from tests.elementary_kinematics import shift
from tests.robocal.formats.calibrated_arms import (
    CalibratedArm,
    calibrated_arm,
    largest_difference,
    seen_from,
)

SIX_OR_MORE = ("abb_irb120", "staubli_tx60", "ur3e", "ur5", "ur10e", "kuka_iiwa14")
TOLERANCE = 1e-7
"""The iteration ends at 1e-8 m and rad, a lever of a metre or two on top."""


def easy_joints(arm: CalibratedArm, count: int, seed: int = 4) -> np.ndarray:
    """Joints well inside the limits, with elbow and wrist well bent."""
    rng = np.random.default_rng(seed)
    q = arm.nominal.draw(rng, 40 * count, widest=2.5) * 0.8
    bent = [number for number in (2, 3, 4, 5) if number < q.shape[1]]
    if q.shape[1] == 6:
        bent = [4] if arm.nominal.links[1, 2] > 0 else [2, 4]
    return q[(np.abs(np.sin(q[:, bent])) > 0.35).all(axis=1)][:count]


@pytest.mark.parametrize("name", SIX_OR_MORE)
def test_the_true_robot_stands_where_it_was_told(name):
    arm = calibrated_arm(name)
    q = easy_joints(arm, 200)
    wanted = arm.nominal.poses(q)
    result = compensate_targets(arm.calibrated, wanted, q, in_base=False)
    reached = np.array([reach is Reach.reached for reach in result.reach])
    # The rest lies next to a singular pose or a limit, and says so.
    assert reached.mean() > 0.95
    assert set(result.reach) <= {Reach.reached, Reach.singular, Reach.outside_limits}
    assert largest_difference(wanted[reached], arm.true.poses(result.q[reached])) < TOLERANCE
    assert largest_difference(wanted, arm.true.poses(q)) > 1e-4


@pytest.mark.parametrize("name", ["ur10e", "staubli_tx60"])
def test_the_correction_is_small_so_the_configuration_is_the_nominal_one(name):
    arm = calibrated_arm(name)
    q = easy_joints(arm, 300)
    result = compensate_targets(arm.calibrated, arm.nominal.poses(q), q, in_base=False)
    reached = np.array([reach is Reach.reached for reach in result.reach])
    # Half a millimetre and half a milliradian a parameter; joints far from singular.
    assert np.median(np.abs(result.q - q)[reached].max(axis=1)) < 0.02
    assert np.abs(result.q - q)[reached].max() < 0.3


def test_targets_in_the_robot_base_are_the_same_targets():
    arm = calibrated_arm("ur10e")
    q = easy_joints(arm, 50)
    wanted = arm.nominal.poses(q)
    measuring = compensate_targets(arm.calibrated, wanted, q, in_base=False)
    in_base = seen_from(arm.nominal.base, wanted)
    base = compensate_targets(arm.calibrated, in_base, q, in_base=True)
    assert base.reach == measuring.reach
    np.testing.assert_allclose(base.q, measuring.q, atol=1e-6)


def test_a_scara_meets_the_position_and_states_the_tilt_it_cannot_mend():
    arm = calibrated_arm("abb_irb910sc")
    q = arm.nominal.draw(np.random.default_rng(4), 100) * [0.8, 0.8, 0.8, 0.8]
    q = q[np.abs(np.sin(q[:, 1])) > 0.3]
    wanted = arm.nominal.poses(q)
    result = compensate_targets(arm.calibrated, wanted, q, in_base=False)
    reached = np.array([reach is Reach.reached for reach in result.reach])
    assert reached.mean() > 0.9
    found = arm.true.poses(result.q)
    miss = np.linalg.norm((found - wanted)[:, :3, 3], axis=1)
    assert miss[reached].max() < TOLERANCE
    turned = Rotation.from_matrix(np.swapaxes(wanted[:, :3, :3], 1, 2) @ found[:, :3, :3])
    np.testing.assert_allclose(turned.magnitude(), result.angle_error, atol=1e-9)
    assert np.median(result.angle_error) > 1e-4


@pytest.mark.parametrize("name", ["ur10e", "abb_irb120", "staubli_tx60"])
def test_without_nominal_joints_a_path_is_followed_in_one_configuration(name):
    """A path that one configuration can follow: no joint may jump on the way."""
    arm = calibrated_arm(name)
    start = np.array([0.3, -1.2, 1.4, -0.9, -1.1, 0.4])
    if name != "ur10e":
        start = np.array([0.3, 0.2, 0.5, -0.9, 0.8, 0.4])
    q = start + np.linspace(0, 0.5, 60)[:, None] * [1, -0.4, 0.5, 1, 0.3, -1]
    wanted = arm.nominal.poses(q)
    result = compensate_targets(arm.calibrated, wanted, None, in_base=False)
    assert set(result.reach) == {Reach.reached}
    assert largest_difference(wanted, arm.true.poses(result.q)) < TOLERANCE
    assert np.abs(np.diff(result.q, axis=0)).max() < 0.1


def test_targets_from_all_over_the_workspace_are_found_without_nominal_joints():
    arm = calibrated_arm("ur5e")
    q = easy_joints(arm, 400)
    result = compensate_targets(arm.calibrated, arm.nominal.poses(q), None, in_base=False)
    reached = np.array([reach is Reach.reached for reach in result.reach])
    assert reached.mean() > 0.97
    found = arm.true.poses(result.q[reached])
    assert largest_difference(arm.nominal.poses(q[reached]), found) < TOLERANCE


def narrow_arm(name: str) -> CalibratedArm:
    """A robot whose first joint turns less than once, so that no full turn helps at its end."""
    arm = calibrated_arm(name)
    limits = arm.nominal.limits.copy()
    limits[0] = (-2.8, 2.8)
    calibrated = replace(arm.calibrated, robot=replace(arm.calibrated.robot, limits=limits))
    return replace(arm, calibrated=calibrated, nominal=replace(arm.nominal, limits=limits))


def spoilt_targets(arm: CalibratedArm) -> tuple[np.ndarray, np.ndarray]:
    """A good target, a straight wrist, one at a joint's end, one out of reach; their joints."""
    q = easy_joints(arm, 4)
    q[1, 4] = 0.0
    q[2, 0] = arm.nominal.limits[0, 1]
    wanted = arm.nominal.poses(q)
    wanted[3, :3, 3] += 5.0
    turned_on = q[2:3].copy()
    turned_on[0, 0] += 0.01
    wanted[2] = arm.nominal.poses(turned_on)[0]
    return q, wanted


@pytest.mark.parametrize("name", ["ur10e", "staubli_tx60"])
def test_singular_and_unreachable_targets_and_those_beyond_a_limit_are_told_apart(name):
    arm = narrow_arm(name)
    q, wanted = spoilt_targets(arm)
    result = compensate_targets(arm.calibrated, wanted, q, in_base=False)
    assert result.reach == (
        Reach.reached,
        Reach.singular,
        Reach.outside_limits,
        Reach.not_reached,
    )
    assert result.q[2, 0] > arm.nominal.limits[0, 1]
    assert result.position_error[3] > 1.0


@pytest.mark.parametrize("name", ["ur10e", "staubli_tx60"])
def test_a_joint_beyond_its_limit_is_turned_inside_where_a_full_turn_does_it(name):
    arm = calibrated_arm(name)
    q = easy_joints(arm, 6)
    low, high = arm.nominal.limits[0]
    q[:, 0] = np.repeat([low - 0.01, high + 0.01], 3)
    wanted = arm.nominal.poses(q)
    result = compensate_targets(arm.calibrated, wanted, q, in_base=False)
    # One of these targets is singular with the TX60, wherever its first joint stands.
    assert set(result.reach) <= {Reach.reached, Reach.singular}
    assert Counter(result.reach)[Reach.reached] >= 5
    assert ((result.q[:, 0] >= low) & (result.q[:, 0] <= high)).all()
    assert largest_difference(wanted, arm.true.poses(result.q)) < TOLERANCE


def test_a_prismatic_joint_beyond_its_limit_is_never_turned():
    arm = calibrated_arm("abb_irb910sc")
    slide = int(np.flatnonzero(arm.nominal.prismatic)[0])
    q = np.array([[0.3, 0.9, 0.0, 0.2]])
    q[0, slide] = arm.nominal.limits[slide, 1] + 0.01
    result = compensate_targets(arm.calibrated, arm.nominal.poses(q), q, in_base=False)
    assert result.reach == (Reach.outside_limits,)


def joint_derivative(arm, q: np.ndarray) -> np.ndarray:
    """Derivative of the tool's pose by the joints, by central differences."""
    step = 1e-6 * np.eye(len(q))
    high, low = arm.poses(q + step), arm.poses(q - step)
    turn = Rotation.from_matrix(high[:, :3, :3] @ np.swapaxes(low[:, :3, :3], 1, 2)).as_rotvec()
    return np.hstack([high[:, :3, 3] - low[:, :3, 3], turn]).T / 2e-6


def test_a_target_met_only_beyond_a_singular_pose_is_named_so():
    """Joints next to the straight elbow, asked for poses of its other side."""
    arm = calibrated_arm("ur10e")
    bent = easy_joints(arm, 40)
    start = bent.copy()
    start[:, 2] = -0.3 * np.sign(bent[:, 2])
    bent[:, 2] = 0.3 * np.sign(bent[:, 2])
    wanted = arm.true.poses(bent)
    result = compensate(arm.calibrated.model, wanted, start, np.tile([-20.0, 20.0], (6, 1)))
    away = [row for row, reach in enumerate(result.reach) if reach is Reach.other_configuration]
    assert away
    assert result.position_error[away].max() < TOLERANCE
    for row in away:
        handed = [
            np.sign(np.linalg.det(joint_derivative(arm.true, q[row]))) for q in (start, result.q)
        ]
        assert handed[0] != handed[1]
    assert "on the other side" in missed_sentence(result, away[0], arm.calibrated.robot)


def targets_csv(folder, arm, q, wanted, with_joints):
    quaternion = Rotation.from_matrix(wanted[:, :3, :3]).as_quat(scalar_first=True)
    header = ["pose", "x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz"]
    rows = np.hstack([np.arange(len(q))[:, None], wanted[:, :3, 3] * 1e3, quaternion]).tolist()
    if with_joints:
        header += [f"j{joint}_deg" for joint in range(1, 7)]
        rows = [[*row, *joints] for row, joints in zip(rows, np.degrees(q).tolist(), strict=True)]
    text = "\n".join([",".join(header), *(",".join(map(repr, row)) for row in rows)])
    path = folder / "targets.csv"
    path.write_text(text + "\n")
    write_model(folder / "model.yaml", arm.calibrated)
    return path


def test_the_command_writes_joints_that_reach_and_names_the_lines_that_do_not(tmp_path, call):
    arm = narrow_arm("ur10e")
    q, wanted = spoilt_targets(arm)
    targets = targets_csv(tmp_path, arm, q, wanted, with_joints=True)
    out = tmp_path / "joints.csv"
    command = ("compensate", tmp_path / "model.yaml", targets, "--out", out)
    status, printed, _ = call(*command)
    assert status == 0
    assert "targets.csv line 3: singular" in printed
    assert "targets.csv line 4: outside_limits: met only with joint 1 at 161.0" in printed
    assert "(-160.428 to 160.428 allowed)" in printed
    assert "targets.csv line 5: not_reached: the arm does not come there" in printed
    assert "1 of 4 targets reached" in printed
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert [row["pose"] for row in rows] == ["0.0", "1.0", "2.0", "3.0"]
    joints = np.radians([[float(rows[0][f"j{joint}_deg"]) for joint in range(1, 7)]])
    assert largest_difference(wanted[:1], arm.true.poses(joints)) < TOLERANCE
    assert all(rows[3][f"j{joint}_deg"] == "" for joint in range(1, 7))
    document = json.loads(call(*command, "--json")[1])
    assert [row["line"] for row in document["missed"]] == [3, 4, 5]


def test_the_command_takes_targets_in_the_robot_base_without_joints(tmp_path, call):
    arm = calibrated_arm("ur10e")
    q = easy_joints(arm, 20)
    wanted = arm.nominal.poses(q)
    targets = targets_csv(tmp_path, arm, q, seen_from(arm.nominal.base, wanted), with_joints=False)
    out = tmp_path / "joints.csv"
    command = ("compensate", tmp_path / "model.yaml", targets, "--out", out, "--frame", "base")
    assert call(*command)[0] == 0
    rows = list(csv.DictReader(out.read_text().splitlines()))
    reached = np.array([row["status"] == "reached" for row in rows])
    assert reached.mean() >= 0.9
    joints = [[float(row[f"j{joint}_deg"] or 0) for joint in range(1, 7)] for row in rows]
    found = arm.true.poses(np.radians(joints))
    assert largest_difference(wanted[reached], found[reached]) < TOLERANCE


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (lambda text: text.replace("qz", "note_qz"), "line 1: column 'qz' is missing"),
        (lambda text: text.replace("j6_deg", "note_j6"), "line 1: column 'j6_deg' is missing"),
        (lambda text: text.replace("x_mm", "x_m"), "line 1: column 'x_m' is not known"),
        (lambda text: text.rsplit(",", 1)[0] + ",\n", "line 5: column 'j6_deg' is empty"),
        (lambda text: text.replace("\n1.0,", "\n1.0,x"), "line 3: column 'x_mm' must be a number"),
    ],
)
def test_a_spoilt_target_table_is_named_with_its_line(tmp_path, call, spoil, complaint):
    arm = calibrated_arm("ur10e")
    targets = targets_csv(tmp_path, arm, *spoilt_targets(arm), with_joints=True)
    targets.write_text(spoil(targets.read_text()))
    out = tmp_path / "joints.csv"
    status, _, said = call("compensate", tmp_path / "model.yaml", targets, "--out", out)
    assert (status, said.count("\n")) == (2, 1)
    assert complaint in said
    assert not out.exists()


def test_when_no_target_is_reached_the_command_says_so_in_its_exit_status(tmp_path, call):
    arm = calibrated_arm("ur10e")
    q = easy_joints(arm, 3)
    wanted = shift("x", 9.0) @ arm.nominal.poses(q)
    targets = targets_csv(tmp_path, arm, q, wanted, with_joints=True)
    out = tmp_path / "joints.csv"
    status, _, said = call("compensate", tmp_path / "model.yaml", targets, "--out", out)
    assert (status, said.count("\n")) == (3, 1)
    assert "none of the targets" in said


def test_ten_thousand_targets_take_less_than_two_seconds_of_one_core():
    arm = calibrated_arm("ur10e")
    q = easy_joints(arm, 10_000)
    wanted = arm.nominal.poses(q)
    begun = time.process_time()
    result = compensate_targets(arm.calibrated, wanted, q, in_base=False)
    assert time.process_time() - begun < 2.0
    assert Counter(result.reach)[Reach.reached] > 9_500
