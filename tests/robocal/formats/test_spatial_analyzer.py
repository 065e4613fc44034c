"""SpatialAnalyzer's points in all four name forms become a bundle or are refused."""

import numpy as np
import pytest

from robocal.errors import BadInput
from robocal.formats.bundle import read_bundle
from robocal.formats.measured_table import MeasurementOptions
from robocal.formats.spatial_analyzer import read_spatial_analyzer
from robocal.robots.library import load_robot

PLACES = [(1523.1234, -20.5, 310.25), (-1.5e3, 0.125, 4.0), (7.0001, 8.0, -9.5)]
NAMES = [("Cell A", "Poses", "p1"), ("Cell A", "Poses", "p2"), ("Cell A", "Poses", "3")]
REMARKS = "// SpatialAnalyzer 2023.1\n// Frame: World\n// Units: Millimeters\n"
JOINTS = "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg"
Q = [[10.0 * row + joint for joint in range(6)] for row in range(3)]


def sa_text(n_names, separator, extras=""):
    lines = []
    for names, place in zip(NAMES, PLACES, strict=True):
        kept = [
            name.replace(" ", "_" if separator == " " else " ") for name in names[3 - n_names :]
        ]
        lines.append(separator.join([*kept, *map(str, place)]) + extras)
    return REMARKS + "\n".join(lines) + "\n"


def joints_csv(folder, points=None, order=(0, 1, 2)):
    rows = [",".join(map(str, Q[row])) for row in order]
    header = JOINTS
    if points:
        rows = [f"{row},{points[k]}" for row, k in zip(rows, order, strict=True)]
        header += ",point"
    path = folder / "joints.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def read(folder, text, joints=None, units="mm", names=None):
    path = folder / "points.txt"
    path.write_text(text)
    options = MeasurementOptions(
        length_unit=units, names=names, joints=joints or joints_csv(folder)
    )
    return read_spatial_analyzer(path, load_robot("ur5e"), options)


@pytest.mark.parametrize("separator", [" ", ",", ", "])
@pytest.mark.parametrize("extras", ["", "|0.01|0.01|0.02"])
@pytest.mark.parametrize("n_names", [0, 1, 2, 3])
def test_all_four_name_forms_are_read(tmp_path, n_names, separator, extras):
    form = ("none", "target", "group-target", "collection-group-target")[n_names]
    text = sa_text(n_names, separator, extras.replace("|", separator))
    # Without names the uncertainties could be coordinates, so the form must be said.
    table = read(tmp_path, text, names=form)
    np.testing.assert_allclose(table.position, np.array(PLACES) * 1e-3, rtol=1e-15)
    np.testing.assert_allclose(table.joints, np.radians(Q))
    if not extras:
        told = read(tmp_path, text)
        np.testing.assert_array_equal(told.position, table.position)


@pytest.mark.parametrize(("unit", "metres"), [("mm", 1e-3), ("m", 1.0), ("inch", 0.0254)])
def test_units_are_what_the_user_says(tmp_path, unit, metres):
    text = sa_text(1, " ").replace("// Units: Millimeters\n", "")
    np.testing.assert_allclose(
        read(tmp_path, text, units=unit).position, np.array(PLACES) * metres, rtol=1e-15
    )


@pytest.mark.parametrize("names", [["Poses::p1", "Poses::p2", "3"], ["p1", "p2", "3"]])
def test_joints_find_their_points_by_name_whatever_the_order(tmp_path, names):
    joints = joints_csv(tmp_path, names, order=(2, 0, 1))
    table = read(tmp_path, sa_text(3, ","), joints)
    np.testing.assert_allclose(table.joints, np.radians([Q[2], Q[0], Q[1]]))
    expected = np.array([PLACES[2], PLACES[0], PLACES[1]]) * 1e-3
    np.testing.assert_allclose(table.position, expected, rtol=1e-15)
    assert table.other["note_point"] == (
        "Cell A::Poses::3",
        "Cell A::Poses::p1",
        "Cell A::Poses::p2",
    )


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("", "has no point"),
        ("// only a remark\n", "has no point"),
        ("g p1 1.0 2.0 3.0\np2 1.0 2.0 3.0\n", "more than one form fits.*--names"),
        ("1.0 2.0 3.0 4.0 5.0 6.0\n" * 3, "more than one form fits.*--names"),
        ("g 1.5 1.0 2.0 3.0\n" * 3, "more than one form fits.*--names"),
        ("g 1 100 200 300\n" * 3, "no form fits.*--names"),
        ("p1 1.0 2.0\n" * 3, "no form fits.*--names"),
        (sa_text(1, " ").replace("Millimeters", "Inches"), "line 3.*inch"),
        (sa_text(1, " ") + "p9 1.0 2.0 3.0\n", "has 3 rows, points.txt has 4"),
    ],
)
def test_points_that_cannot_be_used_are_named(tmp_path, text, complaint):
    with pytest.raises(BadInput, match=complaint):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("line", "complaint"),
    [("g p 1.0 2.0", "line 1.*4 fields"), ("g p 1.0 x 3.0", "line 1.*three numbers"),
     ("g p 1.0 nan 3.0", "line 1.*finite")],
)  # fmt: skip
def test_a_line_that_does_not_fit_its_form_is_named(tmp_path, line, complaint):
    with pytest.raises(BadInput, match=complaint):
        read(tmp_path, line + "\n", names="group-target")


def test_a_name_that_is_missing_or_shared_is_named_with_the_line_of_the_joints(tmp_path):
    with pytest.raises(BadInput, match=r"joints\.csv line 3.*'p7' is not in points\.txt"):
        read(tmp_path, sa_text(1, " "), joints_csv(tmp_path, ["p1", "p7", "3"]))
    with pytest.raises(BadInput, match=r"points\.txt line 5.*'p1' is there twice"):
        read(tmp_path, sa_text(1, " ").replace("p2", "p1"), joints_csv(tmp_path, ["p1"] * 3))
    shared = "a p1 1.0 2.0 3.0\nb p1 1.0 2.0 4.0\n"
    with pytest.raises(BadInput, match=r"joints\.csv line 2.*several points"):
        read(tmp_path, shared, joints_csv(tmp_path, ["p1"], order=(0,)))


@pytest.mark.parametrize(
    "options",
    [
        MeasurementOptions(joints=None, length_unit="mm"),
        MeasurementOptions(length_unit=None),
        MeasurementOptions(length_unit="cm"),
    ],
)
def test_what_the_file_does_not_say_must_be_said(tmp_path, options):
    path = tmp_path / "points.txt"
    path.write_text(sa_text(1, " "))
    with pytest.raises(BadInput, match="option --"):
        read_spatial_analyzer(path, load_robot("ur5e"), options)


def test_the_command_makes_a_bundle_of_points_and_joints(tmp_path, call):
    points = tmp_path / "points.txt"
    points.write_text(sa_text(3, ","))
    joints = joints_csv(tmp_path, ["p1", "p2", "3"])
    command = ("convert", points, "--format", "spatial-analyzer", "--out", tmp_path / "bundle")
    told = ("--robot", "ur5e", "--joints", joints, "--units", "mm", "--sigma-mm", "0.02")
    status, printed, _ = call(*command, *told, "--sigma-ppm", "6")
    assert status == 0
    assert "joined by name" in printed
    bundle = read_bundle(tmp_path / "bundle")
    np.testing.assert_allclose(bundle.measurements.position, np.array(PLACES) * 1e-3, rtol=1e-15)
    assert bundle.instrument.fixed == pytest.approx(2e-5)
    assert bundle.robot.name == "ur5e"
    for left_out in ("--robot", "--sigma-mm", "--units"):
        where = told.index(left_out)
        status, _, complaint = call(*command, *told[:where], *told[where + 2 :])
        assert (status, complaint.count("\n")) == (2, 1)
        assert left_out in complaint
