"""An alarm needs evidence with a clear name, and noise alone raises it as seldom as stated."""

import numpy as np
import pytest

from robocal.diagnosis import find
from robocal.diagnosis.alarm import named_evidence, null_threshold
from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.group import Group, listed
from robocal.diagnosis.screen import screen
from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases


def group_of(effect, joint, odds):
    """One candidate with this Bayes factor against nothing."""
    own = Instance(effect, joint, (), (Coefficient("step_rad", 1.0),))
    # What the data know of the coefficient, 1, costs half a log 2 and adds a quarter of b squared.
    score = np.sqrt(4.0 * (np.log(odds) + 0.5 * np.log(2.0)))
    return Group(
        effect,
        joint,
        listed([own]),
        np.ones((1, 1)),
        np.zeros(1),
        np.ones((1, 1, 1)),
        np.full((1, 1, 1), score),
    )


def test_equal_evidence_counts_more_on_one_name_than_on_many():
    clear = [group_of("backlash", 1, 37.0), *(group_of("backlash", j, 1.0) for j in (2, 3, 4))]
    many = [group_of("backlash", joint, 10.0) for joint in (1, 2, 3, 4)]
    assert named_evidence(clear)[0] == pytest.approx(np.log(40.0) + 7.0 * np.log(37.0 / 40.0))
    assert named_evidence(many)[0] == pytest.approx(np.log(40.0) - 7.0 * np.log(4.0))


def test_candidates_of_one_name_count_together():
    searched_and_listed = [group_of("gear_harmonic", 3, 20.0), group_of("gear_harmonic", 3, 30.0)]
    assert named_evidence(searched_and_listed)[0] == pytest.approx(np.log(50.0))


def test_strong_evidence_raises_an_alarm_whatever_its_name():
    two = [group_of("payload_compliance", 5, 1e6), group_of("joint_compliance", 5, 1e6)]
    assert named_evidence(two)[0] > np.log(1e3)


def test_noise_exceeds_the_threshold_as_seldom_as_stated(call, tmp_path, monkeypatch):
    asked = []

    def spied(rows, fit, *rest, **named):
        asked.append((rows, fit))
        return null_threshold(rows, fit, *rest, **named)

    monkeypatch.setattr(find, "null_threshold", spied)
    cases = write_cases(tmp_path / "cases", "--kind", "clean", "--seed", "307")
    run_diagnose(call, cases / "0000", tmp_path / "out")
    ((rows, fit),) = asked
    noise = np.random.default_rng(2).normal(size=(len(fit.r), 3000))
    noise -= fit.basis @ (fit.basis.T @ noise)
    evidence = named_evidence(screen(rows, fit, noise))
    for chance in (0.03, 0.1):
        threshold = null_threshold(rows, fit, chance, draws=400, seed=1)
        assert np.mean(evidence > threshold) == pytest.approx(chance, rel=0.5)
