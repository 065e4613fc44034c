"""Still joints, few rows, one wrong row: what no cause explains is told for what it is."""

import pytest


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
