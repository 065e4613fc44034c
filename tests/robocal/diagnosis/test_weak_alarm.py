"""A cause that the data hardly show is named with the chance that nothing is there."""

import json

import pytest

from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases


@pytest.fixture
def weak(call, tmp_path):
    """A backlash of Lambda 2.35, diagnosed: what was printed, and the folder."""
    case = ("--kind", "one", "--effect", "backlash", "--seed", "306")
    cases = write_cases(tmp_path / "cases", *case)
    return run_diagnose(call, cases / "0000", tmp_path / "out"), tmp_path / "out"


def test_a_weak_cause_may_be_nothing_and_every_report_says_so(weak):
    printed, out = weak
    (effect,) = json.loads((out / "diagnosis.json").read_text())["effects"]
    assert effect["nothing_probability"] > 0.05
    assert f"nothing but noise ({effect['nothing_probability']:.2f})" in printed
    told = f"nothing but noise ({100 * effect['nothing_probability']:.0f} %)"
    assert told in (out / "report.html").read_text()


def test_what_the_bundle_has_already_is_not_asked_for(weak):
    """The backlash was seen by the directions of approach: they are there."""
    steps = json.loads((weak[1] / "diagnosis.json").read_text())["next_steps"]
    assert steps["between"][1] == "nothing"
    assert not any("approach" in words for words in steps["words"])
    assert any("hardly stands out" in words for words in steps["words"])
