"""Whatever is wrong with the input: one line that names file and line, status 2, nothing written."""

import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.measured_cell import true_cell, write_bundle

JOINTS = ",".join(f"j{i}_deg" for i in range(1, 7))
PATIENCE = 20.0
"""Longest that a refusal may take on a slow machine [s]"""


@pytest.fixture(scope="module")
def measured(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("measured")
    write_bundle(folder, "ur5e", true_cell("ur5e", 1), rows=48)
    return folder


@pytest.fixture
def bundle(measured, tmp_path) -> Path:
    return Path(shutil.copytree(measured, tmp_path / "bundle"))


def edit(file: str, change: Callable[[str], str]) -> Callable[[Path], None]:
    """A way to spoil one file."""

    def spoil(folder: Path) -> None:
        path = folder / file
        before = path.read_text()
        after = change(before)
        assert after != before
        path.write_text(after)

    return spoil


def replaced(file: str, old: str, new: str) -> Callable[[Path], None]:
    return edit(file, lambda text: text.replace(old, new, 1))


def cell(line: int, column: int, value: str) -> Callable[[Path], None]:
    """Put `value` into one cell of measurements.csv; lines count from 1, columns from 0."""

    def change(text: str) -> str:
        lines = [row.split(",") for row in text.splitlines()]
        lines[line - 1][column] = value
        return "\n".join(map(",".join, lines)) + "\n"

    return edit("measurements.csv", change)


def column(name: str, values: Callable[[int], str]) -> Callable[[Path], None]:
    """Add a column to measurements.csv."""

    def change(text: str) -> str:
        header, *rows = text.splitlines()
        wider = [f"{row},{values(index)}" for index, row in enumerate(rows)]
        return "\n".join([f"{header},{name}", *wider]) + "\n"

    return edit("measurements.csv", change)


def keep(rows: int) -> Callable[[Path], None]:
    return edit("measurements.csv", lambda text: "\n".join(text.splitlines()[: rows + 1]) + "\n")


def content(file: str, text: str | bytes) -> Callable[[Path], None]:
    raw = text if isinstance(text, bytes) else text.encode()
    return lambda folder: (folder / file).write_bytes(raw) and None


def campaign(extra: str) -> Callable[[Path], None]:
    return edit("campaign.yaml", lambda text: f"{text}{extra}\n")


def robot(old: str, new: str) -> Callable[[Path], None]:
    return replaced("robot.yaml", old, new)


FIRST_JOINT = "theta_deg: 0, d_mm: 162.5"
TABLE = {
    "unit of a joint": (replaced("measurements.csv", "j2_deg", "j2_rad"), "measurements.csv line 1: .*'j2_deg' is missing.*j2_rad"),
    "unit of a position": (replaced("measurements.csv", "x_mm", "x_m"), "measurements.csv line 1: .*x_m'"),
    "missing joint": (replaced("measurements.csv", "j6_deg", "note_j"), "measurements.csv line 1: column 'j6_deg' is missing.*6 joints"),
    "extra joint": (column("j7_deg", lambda _: "1"), "measurements.csv line 1: .*j7_deg.*6 joints"),
    "missing position": (replaced("measurements.csv", "z_mm", "note_z"), "measurements.csv line 1: column 'z_mm' is missing"),
    "unknown column": (column("temprature_degc", lambda _: "20"), "measurements.csv line 1: .*did you mean 'temperature_degc'"),
    "text in a number": (cell(7, 3, "12,5".replace(",", ";")), "measurements.csv line 7: column 'j4_deg'.*12;5"),
    "letters in a number": (cell(49, 8, "abc"), "measurements.csv line 49: column 'z_mm'.*abc"),
    "underscore in a number": (cell(9, 6, "1_000.5"), "measurements.csv line 9: column 'x_mm'.*1_000.5"),
    "NaN": (cell(3, 0, "NaN"), "measurements.csv line 3: column 'j1_deg'.*NaN"),
    "infinity": (cell(4, 7, "-inf"), "measurements.csv line 4: column 'y_mm'.*inf"),
    "number beyond all numbers": (cell(4, 7, "1e999"), "measurements.csv line 4: column 'y_mm'.*1e999"),
    "number beyond all ranges": (cell(5, 7, "1e200"), "measurements.csv line 5: .*y_mm.*1e\\+?200"),
    "duplicate header": (replaced("measurements.csv", "j2_deg", "j1_deg"), "measurements.csv line 1: column 'j1_deg' is there twice"),
    "empty file": (content("measurements.csv", ""), "measurements.csv line 1: has no header"),
    "header only": (keep(0), "measurements.csv: has a header but no rows"),
    "short row": (edit("measurements.csv", lambda t: t.replace("\n", ",1\n", 2).replace(",1\n", "\n", 1)), "measurements.csv line 2: has 14 cells, the header has 13"),
    "long quote": (cell(5, 0, '"1'), "measurements.csv line \\d+: is not CSV"),
    "quaternion not of length one": (cell(11, 9, "2.0"), "measurements.csv line 11: quaternion"),
    "quaternion of zeros": (edit("measurements.csv", lambda t: "\n".join(re.sub(r"(,[^,]*){4}$", ",0,0,0,0", r) if n == 5 else r for n, r in enumerate(t.splitlines()))), "measurements.csv line 6: quaternion"),
    "half a quaternion": (cell(12, 10, ""), "measurements.csv line 12: .*qx"),
    "quaternion without qz": (replaced("measurements.csv", ",qz", ",note_qz"), "measurements.csv line 1: column 'qz' is missing"),
    "another word in split": (column("split", lambda row: "fit" if row else "test"), "measurements.csv line 2: column 'split' must be fit or check, not 'test'"),
    "hole in split": (column("split", lambda row: "fit" if row != 4 else ""), "measurements.csv line 6: column 'split'"),
    "everything held out": (column("split", lambda _: "check"), "measurements.csv: every row is held out"),
    "pose that is no whole number": (column("pose", lambda row: f"{row}.5"), "measurements.csv line 2: column 'pose'"),
    "pose beyond all numbers": (column("pose", lambda _: "1e30"), "measurements.csv line 2: column 'pose'"),
    "approach from nowhere": (column("approach2", lambda row: "0" if row else "3"), "measurements.csv line 2: column 'approach2'"),
    "3 poses for 30 parameters": (keep(3), "measurements.csv lines? 2.*30 parameters"),
    "5 poses and 1 held out": (keep(5), "measurements.csv lines? 2.*24 numbers for 30 parameters"),
    "binary file": (content("measurements.csv", np.random.default_rng(1).bytes(5000)), "measurements.csv: is not UTF-8"),
    "zeros for a file": (content("measurements.csv", bytes(5000)), "measurements.csv line 1: "),
    "semicolons": (edit("measurements.csv", lambda text: text.replace(",", ";")), "measurements.csv line 1: column 'j1_deg' is missing"),
    "no measurements": (lambda folder: (folder / "measurements.csv").unlink(), "measurements.csv: no such file"),
    "measurements as a folder": (lambda folder: [(folder / "measurements.csv").unlink(), (folder / "measurements.csv").mkdir()], "measurements.csv: cannot be read"),
}  # fmt: skip
YAML = {
    "tabs": (replaced("campaign.yaml", "gravity:", "\tgravity:"), "campaign.yaml line \\d: is not valid YAML"),
    "duplicate key": (campaign("gravity: [0, 0, 1]"), "campaign.yaml line 5: field 'gravity' is twice"),
    "unknown key": (campaign("gravitiy: [0, 0, 1]"), "campaign.yaml line 5: field 'gravitiy' is not known; did you mean 'gravity'"),
    "unknown key deep down": (replaced("campaign.yaml", "sigma_ppm", "sigma_pmm"), "campaign.yaml line 3: field 'instrument.sigma_pmm' is not known; did you mean 'sigma_ppm'"),
    "negative sigma": (replaced("campaign.yaml", "sigma_mm: 0.015", "sigma_mm: -0.015"), "campaign.yaml line 3: field 'instrument.sigma_mm' must be positive"),
    "sigma of zero": (replaced("campaign.yaml", "sigma_mm: 0.015", "sigma_mm: 0"), "campaign.yaml line 3: field 'instrument.sigma_mm' must be positive"),
    "sigma in words": (replaced("campaign.yaml", "sigma_mm: 0.015", "sigma_mm: small"), "campaign.yaml line 3: .*sigma_mm' must be a number, not 'small'"),
    "sigma NaN": (replaced("campaign.yaml", "sigma_mm: 0.015", "sigma_mm: nan"), "campaign.yaml line 3: .*sigma_mm' must be a finite number"),
    "no instrument": (replaced("campaign.yaml", "instrument:", "instruments:"), "campaign.yaml line 1: field 'instrument' is missing"),
    "robot outside the folder": (replaced("campaign.yaml", "robot.yaml", "../robot.yaml"), "campaign.yaml line 1: field 'robot' must name a file beside"),
    "absolute robot": (replaced("campaign.yaml", "robot.yaml", "/etc/passwd"), "campaign.yaml line 1: field 'robot' must name a file beside"),
    "robot is the folder above": (replaced("campaign.yaml", "robot.yaml", ".."), "campaign.yaml line 1: field 'robot' must name a file beside"),
    "robot is nothing": (replaced("campaign.yaml", "robot.yaml", "''"), "campaign.yaml line 1: field 'robot' must name a file beside"),
    "robot is not there": (replaced("campaign.yaml", "robot.yaml", "other.yaml"), "other.yaml: no such file"),
    "gravity of zero": (replaced("campaign.yaml", "[0, 0, -1]", "[0, 0, 0]"), "campaign.yaml line 4: field 'gravity' must not be zero"),
    "gravity of two": (replaced("campaign.yaml", "[0, 0, -1]", "[0, -1]"), "campaign.yaml line 4: field 'gravity' must have 3 numbers"),
    "more held out than there is": (campaign("held_out: {fraction: 1.5}"), "campaign.yaml line 5: field 'held_out.fraction' must be in"),
    "negative seed": (campaign("held_out: {fraction: 0.2, seed: -1}"), "campaign.yaml line 5: field 'held_out.seed'"),
    "broken seed": (campaign("held_out: {fraction: 0.2, seed: 1.5}"), "campaign.yaml line 5: field 'held_out.seed'"),
    "split that is not there": (campaign("held_out: {column: split}"), "campaign.yaml line 5: .*'split', which measurements.csv lacks"),
    "list for a file": (content("campaign.yaml", "- a\n- b\n"), "campaign.yaml line 1: the file must be a mapping"),
    "empty campaign": (content("campaign.yaml", ""), "campaign.yaml: is empty"),
    "comment only": (content("campaign.yaml", "# nothing\n"), "campaign.yaml: is empty"),
    "two documents": (campaign("---\nrobot: robot.yaml"), "campaign.yaml line \\d: is not valid YAML"),
    "binary campaign": (content("campaign.yaml", b"\xff\xfe\x00\x01" * 20), "campaign.yaml: is not UTF-8"),
    "control characters": (content("campaign.yaml", "robot: \x01\x02"), "campaign.yaml.*: is not valid YAML"),
    "unknown alias": (campaign("anchor: *nowhere"), "campaign.yaml line 5: is not valid YAML"),
    "alias to itself": (campaign("anchor: &a {xyz_mm: *a}"), "campaign.yaml line 5: field 'anchor.xyz_mm' must be a list"),
    "aliases upon aliases": (content("campaign.yaml", "a0: &a0 [1, 1]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}, *a{i - 1}]\n" for i in range(1, 60))), "campaign.yaml line \\d+: field"),
    "deep nesting": (content("campaign.yaml", "robot: " + "[" * 20000), "campaign.yaml.*: "),
    "deep nesting that closes": (content("campaign.yaml", "robot: " + "[" * 5000 + "]" * 5000), "campaign.yaml.*: "),
    "deep mappings": (content("campaign.yaml", "\n".join(" " * i + f"a{i}:" for i in range(1500))), "campaign.yaml.*: "),
    "10 MB of YAML": (content("campaign.yaml", "robot: robot.yaml\n" + "# padding\n" * 1_000_000), "campaign.yaml: is larger than"),
    "no campaign": (lambda folder: (folder / "campaign.yaml").unlink(), "campaign.yaml: no such file"),
}  # fmt: skip
ROBOT = {
    "joint of no kind": (robot("type: revolute", "type: spherical"), "robot.yaml line 5: .*type' must be revolute or prismatic, not 'spherical'"),
    "unknown convention": (robot("convention: mdh", "convention: dh"), "robot.yaml line 3: field 'convention' must be one of mdh, craig, urdf"),
    "limits swapped": (robot("[-360, 360]", "[360, -360]"), "robot.yaml line 5: .*limits_deg' has its lower limit"),
    "one limit": (robot("[-360, 360]", "[360]"), "robot.yaml line 5: .*limits_deg' must have 2 numbers"),
    "length NaN": (robot("d_mm: 162.5", "d_mm: .nan"), "robot.yaml line 5: .*d_mm' must be a number|finite"),
    "length in m": (robot("d_mm: 162.5", "d_m: 0.1625"), "robot.yaml line 5: .*d_m' is not known; did you mean 'd_mm'"),
    "length of text": (robot("d_mm: 162.5", "d_mm: 162;5"), "robot.yaml line 5: .*d_mm' must be a number"),
    "five masses": (edit("robot.yaml", lambda text: "\n".join(text.splitlines()[:-1])), "robot.yaml line .*'links' must have one entry a joint: 6, not 5"),
    "no name": (edit("robot.yaml", lambda text: text.replace("name:", "label:")), "robot.yaml line .*'name' is missing"),
    "robot of four joints": (edit("robot.yaml", lambda text: re.sub(r"(  - \{type.*\n){2}links:\n(.*\n)*", "", text)), "measurements.csv line 1: column 'j5_deg' is there, but robot .* has 4 joints"),
    "robot of seven joints": (edit("robot.yaml", lambda text: re.sub(r"(  - \{type.*\n)links:\n(.*\n)*", r"\1\1", text)), "measurements.csv line 1: column 'j7_deg' is missing"),
    "robot without joints": (content("robot.yaml", "name: a\njoints: []\n"), "robot.yaml line 2: field 'joints' must be a list with at least one entry"),
    "URDF outside the folder": (content("robot.yaml", "name: a\nconvention: urdf\nurdf: ../a.urdf\n"), "robot.yaml line 3: field 'urdf' must name a file beside"),
    "entities in a URDF": (lambda folder: [content("robot.yaml", "name: a\nconvention: urdf\nurdf: a.urdf\n")(folder), content("a.urdf", '<!DOCTYPE r [<!ENTITY a "aaaa">]><robot>&a;</robot>')(folder)], "a.urdf: .*entities"),
    "axis of a URDF that points nowhere": (lambda folder: [content("robot.yaml", "name: a\nconvention: urdf\nurdf: a.urdf\n")(folder), content("a.urdf", URDF_JOINT.format(axis="0 0 0", lower=-1, upper=1))(folder)], "a.urdf.*: .*'j'.*axis"),
    "limits of a URDF swapped": (lambda folder: [content("robot.yaml", "name: a\nconvention: urdf\nurdf: a.urdf\n")(folder), content("a.urdf", URDF_JOINT.format(axis="0 0 1", lower=1, upper=-1))(folder)], "a.urdf.*: .*'j'.*limit"),
    "limits of a URDF NaN": (lambda folder: [content("robot.yaml", "name: a\nconvention: urdf\nurdf: a.urdf\n")(folder), content("a.urdf", URDF_JOINT.format(axis="0 0 1", lower="nan", upper=1))(folder)], "a.urdf.*: .*'j'.*limit"),
}  # fmt: skip
URDF_JOINT = """<robot name="a"><link name="l0"/><link name="l1"/>
<joint name="j" type="revolute"><parent link="l0"/><child link="l1"/><axis xyz="{axis}"/>
<limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/></joint></robot>"""


def parametrised(cases: dict) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("spoil", "complaint"), cases.values(), ids=cases)


def assert_refused(call, folder: Path, out: Path, complaint: str) -> None:
    before = time.monotonic()
    status, printed, said = call("identify", folder, "--out", out, "--json")
    assert time.monotonic() - before < PATIENCE
    assert re.search(complaint, said), said
    assert said.startswith("robocal: ")
    assert said.count("\n") == 1
    assert len(said) < 400
    assert (status, printed) == (2, "")
    assert not out.exists()


@parametrised(TABLE)
def test_a_wrong_table_is_refused_by_line(call, bundle, tmp_path, spoil, complaint):
    spoil(bundle)
    assert_refused(call, bundle, tmp_path / "out", complaint)


@parametrised(YAML)
def test_a_wrong_campaign_is_refused_by_line(call, bundle, tmp_path, spoil, complaint):
    spoil(bundle)
    assert_refused(call, bundle, tmp_path / "out", complaint)


@parametrised(ROBOT)
def test_a_wrong_robot_is_refused_by_line(call, bundle, tmp_path, spoil, complaint):
    spoil(bundle)
    assert_refused(call, bundle, tmp_path / "out", complaint)


def test_a_bundle_that_is_no_folder_is_named(call, bundle, tmp_path):
    for wrong in (tmp_path / "nowhere", bundle / "robot.yaml"):
        assert_refused(call, wrong, tmp_path / "out", re.escape(str(wrong)))


def test_a_byte_order_mark_is_no_fault(call, bundle, tmp_path):
    for file in ("campaign.yaml", "robot.yaml", "measurements.csv"):
        raw = (bundle / file).read_bytes()
        (bundle / file).write_bytes(b"\xef\xbb\xbf" + raw.replace(b"\n", b"\r\n"))
    status, _, said = call("identify", bundle, "--out", tmp_path / "out")
    assert (status, said) == (0, "")


def test_a_row_without_a_reading_is_named_and_the_rest_is_used(call, bundle, tmp_path):
    for spoil in (cell(5, 2, ""), cell(9, 7, "")):
        spoil(bundle)
    status, printed, _ = call("identify", bundle, "--out", tmp_path / "out")
    assert status == 0
    assert "line 5 not used: a joint reading is missing" in printed
    assert "line 9 not used: a coordinate of the position is missing" in printed


@pytest.mark.parametrize("distinct", [1, 2, 3])
def test_the_same_few_poses_again_and_again_give_no_traceback(call, bundle, tmp_path, distinct):
    """Forty rows, but all of them at the same places: an honest rank, or status 3."""

    def repeat(text: str) -> str:
        header, *rows = text.splitlines()
        return "\n".join([header, *(rows[k % distinct] for k in range(40))]) + "\n"

    edit("measurements.csv", repeat)(bundle)
    status, _, said = call("identify", bundle, "--out", tmp_path / "out")
    assert status in (0, 2, 3)
    assert said.count("\n") == (0 if status == 0 else 1)


MODEL = {
    "no model": (lambda path: path.unlink(), "model.yaml: no such file"),
    "another format": (lambda path: path.write_text("format: other\n"), "model.yaml line 1: field 'format' must be"),
    "robot.yaml for a model": (lambda path: path.write_text("name: a\n"), "model.yaml line 1: field 'format' is missing"),
    "link missing": (lambda path: path.write_text(re.sub(r"\nlinks:\n- .*\n(  .*\n)?", "\nlinks:\n", path.read_text())), "model.yaml line \\d+: field 'links' must have 6 rows, not 5"),
    "covariance of letters": (lambda path: path.write_text(re.sub(r"matrix_deg_mm:\n  - \[[^,]*,", "matrix_deg_mm:\n  - [x,", path.read_text())), "model.yaml line \\d+: field 'covariance.matrix_deg_mm' must be a number"),
    "unknown effect": (lambda path: path.write_text(path.read_text().replace("effects: []", "effects: [{effect: magic}]")), "model.yaml line \\d+: .*effect"),
}  # fmt: skip


@pytest.fixture(scope="module")
def model(measured, tmp_path_factory) -> Path:
    from datetime import UTC, datetime

    from robocal.formats.model_yaml import write_model
    from service.calibration import calibrate

    _, _, calibrated = calibrate(measured, "simultaneous", datetime.now(UTC))
    path = tmp_path_factory.mktemp("model") / "model.yaml"
    write_model(path, calibrated)
    return path


@parametrised(MODEL)
def test_a_wrong_model_is_refused_by_line(call, model, measured, tmp_path, spoil, complaint):
    path = Path(shutil.copy(model, tmp_path / "model.yaml"))
    spoil(path)
    out = tmp_path / "out.csv"
    status, printed, said = call("predict", path, measured / "measurements.csv", "--out", out)
    assert re.search(complaint, said), said
    assert (status, printed, said.count("\n")) == (2, "", 1)
    assert not out.exists()


@pytest.mark.parametrize(
    ("table", "complaint"),
    [
        (f"{JOINTS}\n1,2,3,4,5,\n", "poses.csv line 2: a joint reading is missing"),
        (f"{JOINTS}\n1,2,3,4,5,six\n", "poses.csv line 2: column 'j6_deg'"),
        (f"{JOINTS}\n", "poses.csv: has a header but no rows"),
        ("j1_deg\n1\n", "poses.csv line 1: column 'j2_deg' is missing"),
        (f"{JOINTS},j7_deg\n1,2,3,4,5,6,7\n", "poses.csv line 1: column 'j7_deg'"),
    ],
)
def test_wrong_poses_are_refused_by_line(call, model, tmp_path, table, complaint):
    (tmp_path / "poses.csv").write_text(table)
    out = tmp_path / "out.csv"
    status, printed, said = call("predict", model, tmp_path / "poses.csv", "--out", out)
    assert complaint in said
    assert (status, printed, said.count("\n")) == (2, "", 1)
    assert not out.exists()


@pytest.mark.parametrize(
    "arguments", [("fanuc",), ("ur10e", "--count", "0"), ("ur10e", "--seed", "-1")]
)
def test_a_plan_that_cannot_be_made_leaves_nothing(call, tmp_path, arguments):
    out = tmp_path / "out"
    status, printed, said = call("plan", *arguments, "--out", out)
    assert (status, printed) == (2, "")
    assert said
    assert not out.exists()
