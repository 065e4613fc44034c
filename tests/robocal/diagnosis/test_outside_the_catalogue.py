"""What no effect of the catalogue is must not be named surely; what it goes with is told."""

import json
from pathlib import Path

import pytest

from tests.blind.truth import read_truth
from tests.blind.verdict import read_verdict
from tests.robocal.diagnosis.hidden_cases import write_cases

OUTSIDE = ("tool_heat", "axis_wobble", "four_bar", "target_acceptance")


@pytest.fixture(scope="session")
def outside_cases(tmp_path_factory) -> Path:
    """One bundle for each cause, by one process."""
    folder = tmp_path_factory.mktemp("outside")
    counts = ["--kind", "absent", "--seed", "3", "--size", "2", "--count", str(len(OUTSIDE))]
    chosen = [part for effect in OUTSIDE for part in ("--effect", effect)]
    return write_cases(folder, *counts, *chosen)


@pytest.mark.parametrize("cause", OUTSIDE)
def test_a_cause_outside_the_catalogue_is_told_by_what_it_goes_with(
    call, outside_cases, tmp_path, cause
):
    index = f"{OUTSIDE.index(cause):04d}"
    truth = read_truth(outside_cases / "truth" / f"{index}.json")
    assert call("diagnose", outside_cases / index, "--out", tmp_path)[0] == 0
    verdict = read_verdict(tmp_path)
    assert not verdict.calls_adequate
    assert verdict.covariates[0] in truth.covariates
    document = json.loads((tmp_path / "diagnosis.json").read_text())
    assert all(
        entry["probability"] < 0.5 or entry["outside_the_catalogue"]["probability"] < 0.5
        for entry in document["effects"]
    )
    if document["effects"]:
        report = (tmp_path / "report.html").read_text()
        assert (
            f"Something unknown that goes with {document['depends_on'][0]['covariate']}" in report
        )
