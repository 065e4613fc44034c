"""A cause that the data hardly show is named with the chance that nothing is there."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
ROBOT = ROOT / "tests" / "blind" / "robots" / "staubli_tx60_with_masses.yaml"


@pytest.fixture
def weak(call, tmp_path):
    """A backlash of Lambda 2.35, diagnosed: what was printed, and the folder."""
    program = [sys.executable, "-m", "drivers.emulators.dataset", "--robot", str(ROBOT)]
    places = ["--out", str(tmp_path / "cases"), "--truth", str(tmp_path / "truth")]
    case = ["--kind", "one", "--effect", "backlash", "--seed", "306"]
    subprocess.run([*program, *places, *case], cwd=ROOT, check=True)
    status, printed, complaint = call(
        "diagnose", tmp_path / "cases" / "0000", "--out", tmp_path / "out"
    )
    assert (status, complaint) == (0, "")
    return printed, tmp_path / "out"


def test_a_weak_cause_may_be_nothing_and_every_report_says_so(weak):
    printed, out = weak
    (effect,) = json.loads((out / "diagnosis.json").read_text())["effects"]
    assert effect["nothing_probability"] > 0.05
    assert f"nothing but noise ({effect['nothing_probability']:.2f})" in printed
    told = f"nothing but noise ({100 * effect['nothing_probability']:.0f} %)"
    assert told in (out / "report.html").read_text()
