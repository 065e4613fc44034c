"""A model that leaves more than the declared noise says so wherever it is used."""

import json
from pathlib import Path

import pytest
import yaml

from robocal.calibrated import Provenance, StatedAdequacy
from robocal.errors import BadInput
from robocal.formats.model_yaml import read_model
from robocal.identification.adequacy import judge
from tests.measured_cell import true_cell, write_bundle

WARNING = "this model is not adequate: it leaves more than the noise"


@pytest.fixture(scope="module")
def optimistic_bundle(tmp_path_factory) -> Path:
    """60 full poses of an instrument that is three times as bad as it says."""
    folder = tmp_path_factory.mktemp("optimistic")
    write_bundle(folder, "ur5e", true_cell("ur5e", 2), 60, 2, noise=3.0)
    return folder


@pytest.fixture
def model(optimistic_bundle, call, tmp_path) -> Path:
    assert call("identify", optimistic_bundle, "--out", tmp_path / "found")[0] == 0
    return tmp_path / "found" / "model.yaml"


def stated(model: Path) -> dict:
    return yaml.safe_load(model.read_text())["provenance"]["adequacy"]


def test_identify_writes_its_verdict_into_the_model(model):
    document = json.loads((model.parent / "identification.json").read_text())["adequacy"]
    assert stated(model) == {
        "verdict": "inadequate",
        "reduced_chi_square": document["reduced_chi_square"],
    }
    # Nine times the variance, in a sample of 200 degrees of freedom.
    assert stated(model)["reduced_chi_square"] == pytest.approx(9.0, rel=0.35)
    assert read_model(model).provenance.inadequate


def test_diagnose_writes_the_extended_models_verdict(optimistic_bundle, call, tmp_path):
    assert call("diagnose", optimistic_bundle, "--out", tmp_path)[0] == 0
    document = json.loads((tmp_path / "diagnosis.json").read_text())["adequacy"]
    assert stated(tmp_path / "model.yaml") == {
        "verdict": document["verdict"],
        "reduced_chi_square": document["reduced_chi_square"],
    }


def test_an_adequate_model_is_used_without_a_word(call, sound_bundle, tmp_path):
    assert call("identify", sound_bundle, "--out", tmp_path)[0] == 0
    assert stated(tmp_path / "model.yaml")["verdict"] == "adequate"
    poses = sound_bundle / "measurements.csv"
    command = ("predict", tmp_path / "model.yaml", poses, "--out", tmp_path / "out.csv")
    assert call(*command)[2] == ""


def test_a_model_from_before_the_verdict_was_kept_is_used_without_a_word(
    optimistic_bundle, model, call, tmp_path
):
    document = yaml.safe_load(model.read_text())
    del document["provenance"]["adequacy"]
    model.write_text(yaml.safe_dump(document))
    assert read_model(model).provenance.adequacy is None
    poses = optimistic_bundle / "measurements.csv"
    assert call("predict", model, poses, "--out", tmp_path / "out.csv")[2] == ""


@pytest.mark.parametrize("command", ["predict", "compensate", "export", "station"])
def test_every_use_warns_in_one_line_beside_the_json(
    optimistic_bundle, model, call, tmp_path, command
):
    rows = optimistic_bundle / "measurements.csv"
    arguments = {
        "predict": (model, rows, "--out", tmp_path / "out.csv"),
        "compensate": (model, rows, "--out", tmp_path / "out.csv"),
        "export": (model, "--format", "urdf", "--out", tmp_path / "out.urdf"),
        "station": (model, optimistic_bundle, "--out", tmp_path / "there"),
    }[command]
    status, printed, said = call(command, *arguments, "--json")
    assert status == 0
    json.loads(printed)
    assert said.count("\n") == 1
    assert WARNING in said
    assert "robocal diagnose" in said
    if command == "station":
        assert stated(tmp_path / "there" / "model.yaml")["verdict"] == "inadequate"


def test_an_inadequate_robot_that_reaches_nothing_is_not_called_calibrated(
    optimistic_bundle, model, call, tmp_path
):
    head, *rows = (optimistic_bundle / "measurements.csv").read_text().splitlines()
    column = head.split(",").index("x_mm")
    cells = [row.split(",") for row in rows]
    away = [",".join([*row[:column], "9000", *row[column + 1 :]]) for row in cells]
    targets = tmp_path / "targets.csv"
    targets.write_text("\n".join([head, *away]) + "\n")
    status, _, said = call("compensate", model, targets, "--out", tmp_path / "out.csv")
    assert status == 3
    assert "the identified robot reaches none" in said


def test_a_warning_says_on_which_side_of_the_noise_a_model_is():
    assert "leaves more than" in StatedAdequacy(False, 10.5).warning
    assert "leaves far less than" in StatedAdequacy(False, 0.2).warning
    nothing_left = Provenance("", "", "", "").judged_by(judge(0.0, -1.0)).adequacy
    assert nothing_left == StatedAdequacy(adequate=False, reduced_chi_square=None)
    assert "no measured number was left over" in nothing_left.warning


def test_a_verdict_that_is_none_is_named_with_its_line(model):
    model.write_text(model.read_text().replace("verdict: inadequate", "verdict: superb"))
    with pytest.raises(BadInput, match="verdict' must be adequate or inadequate, not superb"):
        read_model(model)


def test_no_figure_is_stated_where_nothing_was_left_over(model):
    document = yaml.safe_load(model.read_text())
    del document["provenance"]["adequacy"]["reduced_chi_square"]
    model.write_text(yaml.safe_dump(document))
    assert read_model(model).provenance.adequacy.reduced_chi_square is None
