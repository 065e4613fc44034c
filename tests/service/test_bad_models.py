"""A model.yaml, poses or a robot's name that cannot be used: one line, status 2, no result."""

import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.extended import FittedEffect
from robocal.formats.model_yaml import model_text, read_model
from tests.spoilt_bundle import parametrised

ROOT = Path(__file__).parents[2]
JOINTS = ",".join(f"j{i}_deg" for i in range(1, 7))

MODEL = {
    "no model": (lambda path: path.unlink(), "model.yaml: no such file"),
    "another format": (
        lambda path: path.write_text("format: other\n"),
        "model.yaml line 1: field 'format' must be",
    ),
    "robot.yaml for a model": (
        lambda path: path.write_text("name: a\n"),
        "model.yaml line 1: field 'format' is missing",
    ),
    "link missing": (
        lambda path: path.write_text(
            re.sub(r"\nlinks:\n- .*\n(  .*\n)?", "\nlinks:\n", path.read_text())
        ),
        "model.yaml line \\d+: field 'links' must have 6 rows, not 5",
    ),
    "covariance of letters": (
        lambda path: path.write_text(
            re.sub(r"matrix_deg_mm:\n  - \[[^,]*,", "matrix_deg_mm:\n  - [x,", path.read_text())
        ),
        "model.yaml line \\d+: field 'covariance.matrix_deg_mm' must be a number",
    ),
    "unknown effect": (
        lambda path: path.write_text(
            path.read_text().replace("effects: []", "effects: [{effect: magic}]")
        ),
        "model.yaml line \\d+: .*effect",
    ),
}


@pytest.fixture(scope="module")
def model(sound_bundle, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("model")
    program = "from service.cli import main; main()"
    command = [sys.executable, "-c", program, "identify", str(sound_bundle), "--out", str(out)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return out / "model.yaml"


@parametrised(MODEL)
def test_a_wrong_model_is_refused_by_line(call, model, sound_bundle, tmp_path, spoil, complaint):
    path = Path(shutil.copy(model, tmp_path / "model.yaml"))
    spoil(path)
    out = tmp_path / "out.csv"
    status, printed, said = call("predict", path, sound_bundle / "measurements.csv", "--out", out)
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


@pytest.mark.parametrize("command", ["predict", "compensate"])
def test_a_row_without_what_an_effect_needs_is_named_by_file_line_and_column(
    call, model, sound_bundle, tmp_path, command
):
    calibrated = read_model(model)
    needs = Instance("joint_thermal_drift", 2, (), (Coefficient("zero_rad_per_k", 1e-3),))
    not_needs = Instance("encoder_gain", 1, (), (Coefficient("gain", 1e-3),))
    effects = tuple(FittedEffect(one, np.array([1e-5]), np.eye(1)) for one in (not_needs, needs))
    warm = tmp_path / "warm.yaml"
    warm.write_text(model_text(replace(calibrated, effects=effects)))
    status, _, said = call(
        command, warm, sound_bundle / "measurements.csv", "--out", tmp_path / "out.csv"
    )
    assert status == 2
    assert said == (
        "robocal: measurements.csv line 2: lacks temperature_degc, which the model's effects need "
        "(joint_thermal_drift J2)\n"
    )


@pytest.mark.parametrize("command", ["predict", "compensate"])
def test_a_row_of_an_unknown_nest_is_named_by_its_file(
    call, model, sound_bundle, tmp_path, command
):
    header, first, *_ = (sound_bundle / "measurements.csv").read_text().splitlines()
    (tmp_path / "rows.csv").write_text(f"{header},target\n{first},n9\n")
    status, _, said = call(command, model, tmp_path / "rows.csv", "--out", tmp_path / "out.csv")
    assert status == 2
    assert "robocal: rows.csv line 2: target 'n9' is not in the model" in said


@pytest.mark.parametrize(
    "arguments",
    [
        ("fanuc",),
        ("ur10e", "--count", "0"),
        ("ur10e", "--seed", "-1"),
        ("ur10e", "--until-mm", "nan"),
        ("ur10e", "--until-mm", "0"),
        ("ur10e", "--count", "30", "--until-mm", "0.1"),
        ("ur10e", "--colour", "red"),
    ],
)
def test_a_plan_that_cannot_be_made_leaves_nothing(call, tmp_path, arguments):
    out = tmp_path / "out"
    status, printed, said = call("plan", *arguments, "--out", out)
    assert (status, printed) == (2, "")
    assert said.startswith("robocal: ")
    assert said.count("\n") == 1
    assert not out.exists()


def test_a_plan_whose_picture_cannot_be_written_leaves_no_other_file(call, tmp_path):
    (tmp_path / "plan.svg").mkdir()
    asked = ("ur10e", "--count", "12", "--candidates", "40", "--selector", "random")
    status, _, said = call("plan", *asked, "--out", tmp_path)
    assert (status, said.count("\n")) == (2, 1)
    assert "plan.svg" in said
    assert [entry.name for entry in tmp_path.iterdir()] == ["plan.svg"]
