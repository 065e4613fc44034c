"""How verdicts are scored, on diagnoses and truths written by hand."""

import json
from pathlib import Path

import pytest

from tests.blind.confusion import confusion
from tests.blind.intervals import Rate
from tests.blind.rates import RATES, Line, ambiguous
from tests.blind.trials import Place, Trial
from tests.blind.truth import HiddenEffect, Truth
from tests.blind.verdict import REFUSED, Verdict, covariate_kind, read_verdict

NOWHERE = Place(Path("bundle"), Path("truth"), Path("result"))


def hidden(effect="backlash", joint=3, *, order=None, strength=20.0, main=True, listed=True):
    return HiddenEffect(effect, joint, order, None, listed, main, strength / 20.0, strength)


def truth(*effects, kind="one", covariates=(), kindred=(), fault=None):
    return Truth(kind, effects, covariates, kindred, fault, (), 0.052)


def cause(effect, joint=None, probability=1.0, **more):
    entry = {"effect": effect, "probability": probability, **more}
    return entry if joint is None else {**entry, "joint": joint}


def verdict(folder, *named, word="explained", depends=(), faults=()) -> Verdict:
    """What a diagnosis.json with these effects reads as; each is a cause and its rivals."""
    document = {
        "verdict": word,
        "effects": [{**top, "confusable_with": list(rivals)} for top, *rivals in named],
        "depends_on": [{"covariate": name, "p_value": p} for name, p in depends],
        "data_faults": [{"fault": fault, "lines": [7]} for fault in faults],
        "gain": {"held_out_rms_after_mm": 0.0546},
    }
    (folder / "diagnosis.json").write_text(json.dumps(document))
    return read_verdict(folder)


def lines(kind, *trials) -> dict[str, Line]:
    scored = [Trial(NOWHERE, t, v) for t, v in trials]
    return {line.title: line for line in RATES[kind](scored)}


def shares(kind, *trials) -> list[tuple[int, int]]:
    values = [line.value for line in lines(kind, *trials).values()]
    return [(v.hits, v.of) for v in values if hasattr(v, "hits")]


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("j3_deg", "joint3"),
        ("j2_mm", "joint2"),
        ("t_s", "time"),
        ("approach4", "approach4"),
        ("torque2_nm", "torque2"),
        ("tool_orientation", "orientation"),
        ("payload_kg", "payload"),
        ("speed", "speed"),
    ],
)
def test_covariates_are_known_by_their_columns(name, kind):
    assert covariate_kind(name) == kind


def test_a_diagnosis_that_was_refused_is_an_alarm_without_a_name(tmp_path):
    assert read_verdict(tmp_path) == REFUSED
    assert REFUSED.alarmed
    assert not REFUSED.named


def test_a_diagnosis_that_broke_down_is_told_from_one_that_was_refused(tmp_path):
    (tmp_path / "breakdown.txt").write_text("LinAlgError")
    assert read_verdict(tmp_path).word == "broken down"


def test_a_right_name_needs_the_right_joint(tmp_path):
    right = verdict(tmp_path, [cause("backlash", 3)])
    other = verdict(tmp_path, [cause("backlash", 4)])
    found = lines("one", (truth(hidden()), right), (truth(hidden()), other))
    assert found["... all detected: named right"].value.hits == 1


def test_a_gears_order_must_agree_to_half_a_cycle(tmp_path):
    second = hidden("gear_harmonic", 2, order=2.0)
    near = verdict(tmp_path, [cause("gear_harmonic", 2, order=2.2)])
    far = verdict(tmp_path, [cause("gear_harmonic", 2, order=1.0)])
    assert near.names(second)
    assert not far.names(second)


def test_the_stated_set_is_the_smallest_that_holds_95_percent(tmp_path):
    rivals = [cause("settling", 3, 0.3), cause("backlash", 2, 0.04)]
    said = verdict(tmp_path, [cause("settling", 2, 0.66), *rivals])
    assert [c.effect for c in said.named[0].stated] == ["settling", "settling"]
    assert said.states(hidden("settling", 3))
    assert not said.states(hidden("backlash", 2))


def test_the_rates_of_one_effect_count_what_they_say(tmp_path):
    faint, clear = truth(hidden(strength=2.0)), truth(hidden())
    trials = [
        (faint, verdict(tmp_path, word="model_adequate")),
        (clear, verdict(tmp_path, [cause("backlash", 3)])),
        (clear, verdict(tmp_path, [cause("settling", 3, 0.7), cause("backlash", 3, 0.3)])),
        (clear, verdict(tmp_path, word="unknown_cause")),
    ]
    found = lines("one", *trials)
    counts = {t: (v.value.hits, v.value.of) for t, v in found.items() if hasattr(v.value, "hits")}
    assert counts == {
        "one effect: detected": (3, 4),
        "... detected, Lambda >= 8: named right with joint": (1, 3),
        "... all detected: named right": (1, 3),
        "... all detected: in the stated 95 % set": (2, 3),
        "... all detected: something else named beside it": (0, 3),
        "... snr >= 0.25: detected and named right": (1, 3),
    }
    over_floor = found["held-out error after, over the noise floor"].value.value
    assert over_floor == pytest.approx(0.0546 / 0.052)


def test_a_false_alarm_on_clean_data_is_counted(tmp_path):
    silent = verdict(tmp_path, word="model_adequate")
    wrong = verdict(tmp_path, [cause("backlash", 1)])
    assert shares("clean", (truth(), silent), (truth(), wrong))[0] == (1, 2)


def test_two_effects_count_if_both_matter(tmp_path):
    first, second = hidden("backlash", 3), hidden("settling", 2)
    faint = hidden("settling", 2, strength=1.0)
    both = verdict(tmp_path, [cause("settling", 2)], [cause("backlash", 3)])
    more = verdict(
        tmp_path, *([cause(e, j)] for e, j in [("settling", 2), ("backlash", 3), ("backlash", 1)])
    )
    trials = [
        (truth(first, second), both),
        (truth(first, second), more),
        (truth(first, faint), more),
    ]
    assert shares("two", *trials) == [(2, 2), (1, 2)]


def test_a_sure_wrong_name_is_held_against_it_unless_it_says_that_more_is_left(tmp_path):
    wobble = truth(hidden("axis_wobble", 2, listed=False), covariates=("joint2",))
    sure = [cause("gear_harmonic", 2)]
    trials = [
        (wobble, verdict(tmp_path, sure)),
        (wobble, verdict(tmp_path, sure, word="partly_explained", depends=[("j2_deg", 1e-9)])),
        (wobble, verdict(tmp_path, [cause("gear_harmonic", 2, 0.8)])),
        (
            wobble,
            verdict(tmp_path, word="unknown_cause", depends=[("t_s", 1e-4), ("j2_deg", 1e-3)]),
        ),
    ]
    assert shares("absent", *trials) == [(1, 4), (2, 4), (1, 2)]


def test_a_kindred_name_is_no_wrong_name(tmp_path):
    worn = truth(hidden("hysteresis", 2, listed=False), kindred=(("backlash", 2),))
    assert shares("absent", (worn, verdict(tmp_path, [cause("backlash", 2)])))[0] == (0, 1)


def test_the_main_cause_may_stand_in_any_stated_set(tmp_path):
    faint = hidden("settling", 2, strength=4.0, main=False)
    said = verdict(
        tmp_path, [cause("settling", 2)], [cause("settling", 3, 0.6), cause("backlash", 3, 0.4)]
    )
    assert shares("background", (truth(hidden(), faint), said)) == [(1, 1), (1, 1), (0, 1)]


def test_an_ambiguous_case_is_settled_by_a_sure_right_name(tmp_path):
    unsure = verdict(tmp_path, [cause("backlash", 3, 0.6), cause("settling", 3, 0.4)])
    sure = verdict(tmp_path, [cause("backlash", 3, 0.97)])
    wrong = verdict(tmp_path, [cause("settling", 3, 0.97)])
    before = [Trial(NOWHERE, truth(hidden()), v) for v in (unsure, unsure, unsure, sure)]
    after = [Trial(NOWHERE, truth(hidden()), v) for v in (sure, wrong)]
    found = {line.title: line.value for line in ambiguous(before, after)}
    settled = found["ambiguous cases settled by 20 chosen poses"]
    # The third got no poses, and counts.
    assert (settled.hits, settled.of) == (1, 3)


def test_a_data_fault_must_not_be_explained_by_physics(tmp_path):
    slipped = truth(fault="joint_sign", kind="data_fault")
    trials = [
        (slipped, verdict(tmp_path, faults=["joint_sign"], word="model_adequate")),
        (slipped, verdict(tmp_path, [cause("backlash", 3)])),
        (slipped, REFUSED),
    ]
    assert shares("data_fault", *trials) == [(1, 3), (1, 3), (1, 3)]


def test_the_confusion_table_says_what_was_taken_for_what(tmp_path):
    trials = [
        Trial(NOWHERE, truth(hidden()), verdict(tmp_path, word="model_adequate")),
        Trial(NOWHERE, truth(hidden()), verdict(tmp_path, [cause("settling", 3)])),
        Trial(NOWHERE, truth(hidden()), verdict(tmp_path, [cause("backlash", 1)])),
    ]
    row = " ".join(confusion(trials)[1].split())
    assert row == "backlash 3 1 0 settling 1, another joint or order 1"


def test_a_line_says_how_it_stands_to_its_bar():
    assert Line("x", Rate(99, 100), 0.98).standing == "reached"
    assert Line("x", Rate(96, 100), 0.98).standing == "short, not surely"
    assert Line("x", Rate(80, 100), 0.98).standing == "missed"
    assert Line("x", Rate(2, 100), 0.03, at_least=False).standing == "reached"
    assert Line("x", Rate(2, 100)).standing == ""
