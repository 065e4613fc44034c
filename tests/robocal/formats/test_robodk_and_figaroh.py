"""RoboDK's and figaroh's tables, written here by hand with scipy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robocal.errors import BadInput
from robocal.formats.bundle import read_bundle
from robocal.formats.figaroh import read_figaroh
from robocal.formats.measured_table import MeasurementOptions
from robocal.formats.robodk import read_robodk
from robocal.robots.library import load_robot

HEADER = ",".join(f"column {number}" for number in range(18))
RNG = np.random.default_rng(3)
JOINTS = RNG.uniform(-170, 170, (5, 6))
ANGLES = RNG.uniform(-80, 80, (5, 3))
PLACES = RNG.uniform(-900, 900, (5, 3))
TOOL = np.tile([0, 0, 120.5, 0, 0, 0], (5, 1))


def robodk(folder, measured, name="table.csv", header=HEADER):
    rows = np.hstack([JOINTS[: len(measured)], measured, TOOL[: len(measured)]]).tolist()
    path = folder / name
    path.write_text("\n".join([header, *(",".join(map(repr, row)) for row in rows)]) + "\n")
    return path


def rotations(quaternions):
    return Rotation.from_quat(quaternions, scalar_first=True).as_matrix()


@pytest.mark.parametrize(("euler", "scipy_order"), [("zyx", "xyz"), ("xyz", "XYZ")])
def test_a_robodk_table_of_full_poses_is_read_in_the_order_that_is_said(
    tmp_path, euler, scipy_order
):
    path = robodk(tmp_path, np.hstack([PLACES, ANGLES]))
    table = read_robodk(path, load_robot("ur5e"), MeasurementOptions(euler=euler))
    np.testing.assert_allclose(table.joints, np.radians(JOINTS))
    np.testing.assert_allclose(table.position, PLACES / 1e3)
    expected = Rotation.from_euler(scipy_order, ANGLES, degrees=True).as_matrix()
    np.testing.assert_allclose(rotations(table.orientation), expected, atol=1e-14)


def test_a_robodk_table_of_positions_needs_no_order_and_marks_what_was_not_measured(tmp_path):
    measured = np.hstack([PLACES, np.zeros((5, 3))])
    measured[2] = 0.0
    table = read_robodk(robodk(tmp_path, measured), load_robot("ur5e"), MeasurementOptions())
    assert np.isnan(table.orientation).all()
    assert np.isnan(table.position[2]).all()
    assert np.isfinite(np.delete(table.position, 2, axis=0)).all()
    assert table.notes == ("4 of 5 rows measured, 0 full poses",)


def test_angles_of_unknown_order_are_refused(tmp_path):
    path = robodk(tmp_path, np.hstack([PLACES, ANGLES]))
    for euler in (None, "zyz"):
        with pytest.raises(BadInput, match="--euler"):
            read_robodk(path, load_robot("ur5e"), MeasurementOptions(euler=euler))


@pytest.mark.parametrize(
    ("spoil", "complaint"),
    [
        (
            lambda text: "\n".join(line.rsplit(",", 7)[0] for line in text.splitlines()),
            "11 columns",
        ),
        (lambda text: text.replace(repr(float(PLACES[1, 0])), ""), r"line 3.*'column 6' is empty"),
        (lambda text: text.replace(repr(float(PLACES[1, 0])), "x"), r"line 3.*'column 6'"),
    ],
)
def test_a_spoilt_robodk_table_is_named_with_its_line(tmp_path, spoil, complaint):
    path = robodk(tmp_path, np.hstack([PLACES, ANGLES]))
    path.write_text(spoil(path.read_text()))
    with pytest.raises(BadInput, match=complaint):
        read_robodk(path, load_robot("ur5e"), MeasurementOptions(euler="zyx"))


def test_robodk_holds_no_sliding_joint(tmp_path):
    path = robodk(tmp_path, np.hstack([PLACES, ANGLES]))
    with pytest.raises(BadInput, match="six revolute joints"):
        read_robodk(path, load_robot("abb_irb910sc"), MeasurementOptions(euler="zyx"))


def test_the_command_keeps_robodks_validation_rows_out_of_the_fit(tmp_path, call):
    fit = robodk(tmp_path, np.hstack([PLACES, ANGLES]))
    check = robodk(tmp_path, np.hstack([PLACES[:2], ANGLES[:2]]), "check.csv")
    out = tmp_path / "bundle"
    status, printed, _ = call(
        "convert", fit, "--format", "robodk", "--robot", "ur5e", "--check", check, "--euler", "zyx",
        "--sigma-mm", "0.02", "--out", out,
    )  # fmt: skip
    assert status == 0
    assert "check.csv: 2 of 2 rows measured" in printed
    rows = read_bundle(out).measurements
    assert rows.held_out.tolist() == [False] * 5 + [True] * 2
    np.testing.assert_allclose(rows.position[:5], PLACES / 1e3)


def figaroh(folder, markers, angles=True, joints=6):
    columns, header = [], []
    for marker in range(1, markers + 1):
        header += [f"{axis}{marker}" for axis in "xyz"]
        columns.append(PLACES / 1e3 + marker)
        if angles:
            header += [f"phi{axis}{marker}" for axis in "xyz"]
            columns.append(np.radians(ANGLES))
    header += ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"][:joints]
    rows = np.hstack([*columns, np.radians(JOINTS[:, :joints])]).tolist()
    path = folder / "figaroh.csv"
    path.write_text("\n".join([",".join(header), *(",".join(map(repr, row)) for row in rows)]))
    return path


def test_a_figaroh_file_of_one_marker_is_read_in_metres_and_radians(tmp_path):
    table = read_figaroh(figaroh(tmp_path, 1), load_robot("ur5e"), MeasurementOptions())
    np.testing.assert_allclose(table.joints, np.radians(JOINTS))
    np.testing.assert_allclose(table.position, PLACES / 1e3 + 1)
    expected = Rotation.from_euler("xyz", ANGLES, degrees=True).as_matrix()
    np.testing.assert_allclose(rotations(table.orientation), expected, atol=1e-14)


def test_every_marker_of_a_figaroh_file_becomes_a_target(tmp_path, call):
    path, out = figaroh(tmp_path, 2, angles=False), tmp_path / "bundle"
    command = ("convert", path, "--format", "figaroh", "--out", out, "--sigma-mm", "0.5")
    assert call(*command, "--robot", "ur5e")[0] == 0
    bundle = read_bundle(out)
    assert set(bundle.targets) == {"marker1", "marker2"}
    rows = bundle.measurements
    assert rows.target == ("marker1",) * 5 + ("marker2",) * 5
    assert rows.pose.tolist() == [0, 1, 2, 3, 4] * 2
    np.testing.assert_allclose(rows.position[5:], PLACES / 1e3 + 2)


def test_an_infinite_noise_is_refused_before_anything_is_written(tmp_path, call):
    path, out = figaroh(tmp_path, 1), tmp_path / "bundle"
    command = ("convert", path, "--format", "figaroh", "--out", out, "--robot", "ur5e")
    status, _, complaint = call(*command, "--sigma-mm", "inf")
    assert status == 2
    assert "option --sigma-mm: must be a number, not inf" in complaint
    assert not out.exists()


def test_a_figaroh_file_with_other_joints_than_the_robots_is_refused(tmp_path):
    with pytest.raises(BadInput, match=r"line 1.*names 5 joints.*'ur5e' has 6"):
        read_figaroh(figaroh(tmp_path, 1, joints=5), load_robot("ur5e"), MeasurementOptions())


def test_a_figaroh_file_without_a_marker_is_refused(tmp_path):
    path = figaroh(tmp_path, 0)
    with pytest.raises(BadInput, match="no marker"):
        read_figaroh(path, load_robot("ur5e"), MeasurementOptions())
    path = figaroh(tmp_path, 1)
    path.write_text(path.read_text().replace("phiy1,", "phiy2,"))
    with pytest.raises(BadInput, match="line 1"):
        read_figaroh(path, load_robot("ur5e"), MeasurementOptions())
