"""Two hidden causes are told as two: neither lost in the other's form, nor a third one added."""

import pytest

from tests.blind.truth import read_truth
from tests.blind.verdict import read_verdict
from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases


@pytest.fixture
def diagnose_two(call, tmp_path):
    """Hide an effect with a companion that the seed draws; give truth and verdict."""

    def diagnose(effect, seed):
        case = ("--kind", "two", "--effect", effect, "--seed", str(seed))
        cases = write_cases(tmp_path / "cases", *case)
        run_diagnose(call, cases / "0000", tmp_path / "out")
        return read_truth(cases / "truth" / "0000.json"), read_verdict(tmp_path / "out")

    return diagnose


def names(truth):
    return {hidden.title for hidden in truth.main}


@pytest.mark.parametrize(("effect", "seed"), [("base_step", 155), ("warm_up", 101)])
def test_what_comes_slowly_is_not_taken_for_the_form_of_a_step(diagnose_two, effect, seed):
    truth, verdict = diagnose_two(effect, seed)
    assert "base_step" in names(truth)
    assert verdict.is_exactly(truth.main), verdict


@pytest.mark.parametrize("seed", [38, 91, 94])
def test_two_forms_of_one_cause_are_told_as_one(diagnose_two, seed):
    truth, verdict = diagnose_two("warm_up", seed)
    assert verdict.is_exactly(truth.main), verdict
    (warm_up,) = (named.cause for named in verdict.named if named.cause.effect == "warm_up")
    assert warm_up.probability > 0.95


def test_rows_that_a_cause_moves_most_are_no_outliers(diagnose_two):
    truth, verdict = diagnose_two("settling", 304)
    assert verdict.is_exactly(truth.main), verdict
    assert verdict.faults == ()


def test_a_first_row_of_unknown_way_makes_no_step_beside_a_settling_joint(diagnose_two):
    truth, verdict = diagnose_two("settling", 316)
    assert verdict.is_exactly(truth.main), verdict
    assert verdict.faults == ()


def test_an_effect_in_whose_place_nothing_is_the_likelier_is_not_named(diagnose_two):
    truth, verdict = diagnose_two("warm_up", 180)
    assert verdict.is_exactly(truth.main), verdict


@pytest.mark.parametrize(
    ("effect", "seed"),
    [("joint_compliance", 11), ("joint_compliance", 24), ("base_compliance", 39)],
)
def test_what_no_other_mass_or_spring_explains_is_a_second_cause(diagnose_two, effect, seed):
    truth, verdict = diagnose_two(effect, seed)
    assert verdict.is_exactly(truth.main), verdict


@pytest.mark.parametrize("seed", [5, 9, 25])
def test_a_pedestal_that_is_stiffer_one_way_is_one_cause(call, tmp_path, seed):
    case = ("--kind", "other_forms", "--effect", "base_compliance", "--seed", str(seed))
    cases = write_cases(tmp_path / "cases", *case)
    run_diagnose(call, cases / "0000", tmp_path / "out")
    hidden = read_truth(cases / "truth" / "0000.json").main
    assert read_verdict(tmp_path / "out").is_exactly(hidden)
