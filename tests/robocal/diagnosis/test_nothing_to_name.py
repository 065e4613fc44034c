"""Still joints, few rows, one wrong row: what no cause explains is told for what it is."""

import json

import pytest

from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases


@pytest.mark.parametrize("seed", [2, 4])
def test_a_joint_that_stood_still_is_nothing_that_residuals_depend_on(found, seed):
    _, clean = found(seed, poses=80, still=[3])
    assert clean["depends_on"] == []
    assert clean["verdict"] in {"model_adequate", "explained"}
    told = [cause for effect in clean["effects"] for cause in (effect, *effect["confusable_with"])]
    # Noise may look like something, but not like a joint that settles where it stood.
    assert ("settling", 4) not in {(cause["effect"], cause.get("joint")) for cause in told}


@pytest.mark.parametrize(("poses", "noise"), [(14, 1.0), (16, 30.0)])
def test_hardly_more_numbers_than_parameters_name_no_cause(found, poses, noise):
    printed, few = found(7, poses=poses, noise=noise)
    assert few["effects"] == []
    assert "explains" not in printed
    assert "measure at least" in printed


def test_a_wrong_row_among_those_held_out_is_named_and_counts(found):
    printed, clean = found(3, wrong=[7])
    (suspect,) = clean["suspect_held_out_rows"]
    assert suspect["line"] == 9
    assert "measurements.csv line 9, held out, is suspect: outlier" in printed
    assert clean["effects"] == []
    assert clean["gain"]["held_out_rms_after_mm"] > 0.2


def test_good_rows_held_out_are_not_suspect(found):
    assert found(3)[1]["suspect_held_out_rows"] == []


def test_an_error_that_stayed_is_not_shown_as_a_gain(found, tmp_path):
    found(3)
    report = (tmp_path / "out" / "report.html").read_text()
    assert 'class="good"' not in report
    assert 'class="bad"' not in report


def test_rows_held_out_where_a_step_lies_somewhere_are_not_suspect(call, tmp_path):
    case = ("--kind", "one", "--effect", "base_step", "--seed", "11")
    bundle = write_cases(tmp_path / "cases", *case) / "0000"
    run_diagnose(call, bundle, tmp_path / "out")
    (step,) = json.loads((tmp_path / "out" / "diagnosis.json").read_text())["effects"]
    lines = (bundle / "measurements.csv").read_text().splitlines()
    split = lines[0].split(",").index("split")
    for number in range(int(step["line"]) - 4, int(step["line"]) + 4):
        cells = lines[number - 1].split(",")
        cells[split] = "check"
        lines[number - 1] = ",".join(cells)
    (bundle / "measurements.csv").write_text("\n".join(lines) + "\n")
    run_diagnose(call, bundle, tmp_path / "out")
    document = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert document["effects"][0]["effect"] == "base_step"
    assert document["suspect_held_out_rows"] == []
