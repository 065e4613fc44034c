"""A small step of the stand is told from its slow drift: either may be small as well as large."""

import pytest

from tests.blind.truth import read_truth
from tests.blind.verdict import read_verdict
from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases


@pytest.mark.parametrize(
    ("effect", "seed"),
    [("base_step", 402), ("base_step", 406), ("base_drift", 409), ("base_drift", 419)],
)
def test_a_small_move_of_the_stand_is_named_for_how_it_came(call, tmp_path, effect, seed):
    case = ("--kind", "one", "--effect", effect, "--size", "0.5", "--seed", str(seed))
    cases = write_cases(tmp_path / "cases", *case)
    run_diagnose(call, cases / "0000", tmp_path / "out")
    (hidden,) = read_truth(cases / "truth" / "0000.json").main
    verdict = read_verdict(tmp_path / "out")
    assert 5.5 < hidden.strength < 8.0
    assert verdict.is_exactly((hidden,)), verdict
