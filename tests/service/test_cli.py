"""The command line: what it writes, what it prints, and one clear line for whatever is wrong."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.elementary_kinematics import ROBOTS, Arm, frame, load_arm

ROOT = Path(__file__).parents[2]
ENTRY = "from service.cli import main; main()"


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own, warnings shown as Python shows them."""
    return subprocess.run(
        [sys.executable, "-c", ENTRY, *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=ROOT,
        timeout=60,
    )


@pytest.fixture(scope="module")
def identified(sound_bundle, tmp_path_factory) -> Path:
    """What `identify` wrote for it."""
    out = tmp_path_factory.mktemp("identified") / "a" / "new" / "folder"
    done = run("identify", sound_bundle, "--out", out, "--json")
    assert done.returncode == 0, done.stderr
    (out / "printed.json").write_text(done.stdout)
    assert done.stderr == ""
    return out


def arm_of_model(path: Path) -> Arm:
    """The arm that a model.yaml describes, read by the tests' own reader."""
    document = yaml.safe_load(path.read_text())
    links = np.array([
        [np.deg2rad(r["theta_deg"]), r["d_mm"] / 1e3, r["a_mm"] / 1e3,
         np.deg2rad(r["alpha_deg"]), np.deg2rad(r["beta_deg"])]
        for r in document["links"]
    ])  # fmt: skip
    base, tool = (
        frame([*np.array(document[n]["xyz_mm"]) / 1e3, *np.deg2rad(document[n]["ypr_deg"])])
        for n in ("base", "tool")
    )
    return Arm(links, np.zeros(len(links), dtype=bool), np.zeros((len(links), 2)), base, tool)


def test_identify_prints_the_document_that_it_writes(identified):
    printed = json.loads((identified / "printed.json").read_text())
    assert printed == json.loads((identified / "identification.json").read_text())
    assert (identified / "model.yaml").exists()


def test_identification_json_is_what_the_contract_says(identified):
    document = json.loads((identified / "identification.json").read_text())
    names = [parameter["name"] for parameter in document["parameters"]]
    assert names == [f"{p}_{j}" for j in range(1, 7) for p in ("theta", "d", "a", "alpha", "beta")]
    for parameter in document["parameters"]:
        assert {"name", "unit", "nominal", "identified", "std", "status"} <= set(parameter)
        assert parameter["status"] in ("identified", "fixed", "redundant")
        assert ("reason" in parameter) == (parameter["status"] != "identified")
        assert parameter["unit"] == (
            "mm" if parameter["name"][0] in "d" or parameter["name"].startswith("a_") else "deg"
        )
    for name in ("base", "tool"):
        assert [len(document[name][part]) for part in ("xyz_mm", "ypr_deg", "std")] == [3, 3, 6]
    assert document["rank"] == 30
    assert document["strategy"] == "simultaneous"
    residuals = document["residuals"]
    assert residuals["fit"]["rows"] == 36
    assert residuals["held_out"]["rows"] == 12
    for part in ("fit", "held_out", "before"):
        assert 0 < residuals[part]["position_mean_mm"] <= residuals[part]["position_rms_mm"]
        assert residuals[part]["position_rms_mm"] <= residuals[part]["position_max_mm"]
    assert residuals["held_out"]["position_rms_mm"] < 0.1 < residuals["before"]["position_rms_mm"]
    assert document["rejected_rows"] == []


def test_the_standard_deviations_are_in_the_unit_beside_them(identified):
    """15 um over arms of half a metre make some um and some thousandths of a degree."""
    document = json.loads((identified / "identification.json").read_text())
    for parameter in document["parameters"]:
        if parameter["status"] == "identified":
            assert 1e-4 < parameter["std"] < 0.1
    assert all(1e-4 < std < 0.2 for std in document["base"]["std"] + document["tool"]["std"])


def test_both_strategies_are_offered_and_named_in_the_result(call, sound_bundle, tmp_path):
    status, out, _ = call(
        "identify", sound_bundle, "--strategy", "cross", "--out", tmp_path, "--json"
    )
    assert status == 0
    assert json.loads(out)["strategy"] == "cross"


def test_without_json_a_person_reads_before_and_after(call, sound_bundle, tmp_path):
    status, out, _ = call("identify", sound_bundle, "--out", tmp_path)
    assert status == 0
    assert "nominal, frames fitted" in out
    assert "held out" in out
    assert str(tmp_path / "model.yaml") in out


def test_predict_fills_the_columns_with_the_models_poses(call, sound_bundle, identified, tmp_path):
    """Through the model file alone; to the 0.1 nm that the table prints."""
    header = [f"j{i}_deg" for i in range(1, 7)]
    q = load_arm("ur5e").draw(np.random.default_rng(2), 40)
    rows = [",".join(f"{value:.12f}" for value in np.rad2deg(row)) for row in q]
    rows = [f"{n},{row},remark {n}" for n, row in enumerate(rows)]
    (tmp_path / "poses.csv").write_text("\n".join([",".join(["pose", *header, "note_x"]), *rows]))
    out = tmp_path / "predicted.csv"
    status, printed, _ = call(
        "predict", identified / "model.yaml", tmp_path / "poses.csv", "--out", out, "--json"
    )
    assert status == 0
    assert json.loads(printed)["rows"] == 40
    lines = out.read_text().splitlines()
    columns = lines[0].split(",")
    filled = ["x_mm", "y_mm", "z_mm", "qw", "qx", "qy", "qz", "u_x_mm", "u_y_mm", "u_z_mm"]
    assert columns == ["pose", *header, "note_x", *filled]
    assert lines[1].split(",")[columns.index("note_x")] == "remark 0"
    T = arm_of_model(identified / "model.yaml").poses(q)
    cells = np.array([[float(c) for c in line.split(",")[8:15]] for line in lines[1:]])
    np.testing.assert_allclose(cells[:, :3] / 1e3, T[:, :3, 3], atol=1e-10)
    w, x, y, z = cells[:, 3:].T
    np.testing.assert_allclose(2 * (x * z + w * y), T[:, 0, 2], atol=1e-10)
    np.testing.assert_allclose(2 * (x * y + w * z), T[:, 1, 0], atol=1e-10)


def test_predict_agrees_with_the_measurements_to_the_noise(
    call, sound_bundle, identified, tmp_path
):
    out = tmp_path / "predicted.csv"
    status, _, _ = call(
        "predict", identified / "model.yaml", sound_bundle / "measurements.csv", "--out", out
    )
    assert status == 0
    predicted, seen = (
        np.loadtxt(path, delimiter=",", skiprows=1)[:, 6:9]
        for path in (out, sound_bundle / "measurements.csv")
    )
    assert 0.01 < np.sqrt(((predicted - seen) ** 2).sum(axis=1).mean()) < 0.06


def test_plan_writes_poses_that_identify_can_use(call, tmp_path):
    status, printed, _ = call("plan", "ur10e", "--count", 12, "--out", tmp_path, "--json")
    assert status == 0
    json.loads(printed)
    json.loads((tmp_path / "plan.json").read_text())
    lines = (tmp_path / "plan.csv").read_text().splitlines()
    assert len(lines) == 13
    assert [f"j{i}_deg" for i in range(1, 7)] == [c for c in lines[0].split(",") if c[0] == "j"]


def test_plan_takes_a_robot_file_of_ones_own(call, tmp_path):
    own = tmp_path / "own.yaml"
    shutil.copy(ROBOTS / "abb_irb910sc.yaml", own)
    status, _, complaint = call("plan", own, "--count", 8, "--out", tmp_path / "plan")
    assert (status, complaint) == (0, "")
    assert "j3_mm" in (tmp_path / "plan" / "plan.csv").read_text().splitlines()[0]


def test_uncertainty_writes_both_ways_of_reckoning(call, sound_bundle, tmp_path):
    status, printed, _ = call(
        "uncertainty", sound_bundle, "--out", tmp_path, "--draws", 1000, "--json"
    )
    assert status == 0
    document = json.loads(printed)
    assert document == json.loads((tmp_path / "uncertainty.json").read_text())


def test_who_wants_to_import_a_file_is_sent_to_convert(call):
    status, _, complaint = call("import", "arm.urdf")
    assert (status, complaint) == (
        2,
        "robocal: No such command 'import'. It is called 'convert'.\n",
    )
    assert "Did you mean 'identify'?" in call("identfy")[2]


def test_help_needs_neither_scipy_nor_a_web_server():
    program = (
        "import sys; sys.argv = ['robocal', '--help']\n"
        "from service.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "heavy = {'scipy', 'numpy', 'fastapi', 'sqlalchemy', 'uvicorn', 'plotly', 'geocompy'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)"
    )
    shown = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, timeout=30
    )
    assert shown.stderr.strip() == "[]"
    for command in ("identify", "predict", "plan", "uncertainty", "serve", "demo", "emulate"):
        assert command in shown.stdout


@pytest.mark.parametrize("command", ["identify", "uncertainty"])
def test_bad_input_leaves_one_line_and_status_2_in_a_real_process(bundle, tmp_path, command):
    (bundle / "measurements.csv").write_text("j1_deg\n1\n")
    done = run(command, bundle, "--out", tmp_path / "out", "--json")
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("robocal: measurements.csv line 1: ")
    assert not (tmp_path / "out").exists()


def test_a_file_in_place_of_the_out_folder_is_named(call, sound_bundle, tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("mine")
    for out in (taken, taken / "below"):
        status, printed, complaint = call("identify", sound_bundle, "--out", out)
        assert (status, printed) == (2, "")
        assert str(out) in complaint
        assert complaint.count("\n") == 1
    assert taken.read_text() == "mine"


def test_a_folder_in_place_of_the_out_file_is_named(call, sound_bundle, identified, tmp_path):
    for out in (tmp_path, tmp_path / "missing" / "f.csv"):
        status, _, complaint = call(
            "predict", identified / "model.yaml", sound_bundle / "measurements.csv", "--out", out
        )
        assert status == 2
        assert str(out) in complaint
        assert complaint.count("\n") == 1


@pytest.mark.parametrize("file", ["identification.json", "model.yaml"])
def test_a_result_that_cannot_be_written_is_one_line(call, sound_bundle, tmp_path, file):
    (tmp_path / file).mkdir()
    status, _, complaint = call("identify", sound_bundle, "--out", tmp_path)
    assert status == 2
    assert file in complaint
    assert complaint.count("\n") == 1
    assert not list(tmp_path.glob("*.part"))


def test_an_unknown_strategy_is_answered_with_the_known_ones(call, sound_bundle, tmp_path):
    status, _, complaint = call(
        "identify", sound_bundle, "--strategy", "best", "--out", tmp_path / "o"
    )
    assert status == 2
    assert "cross" in complaint
    assert "simultaneous" in complaint
    assert not (tmp_path / "o").exists()
