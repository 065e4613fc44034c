from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest

from robocal.uncertainty.evaluation import Settings, evaluate
from robocal.uncertainty.refit_verdict import judge_refits
from robocal.uncertainty.refits import refit
from robocal.uncertainty.repeats import scatter_of_repeats
from tests.robocal.uncertainty.campaign_bundles import campaign


def test_one_two_and_three_processes_find_the_same_bits(tmp_path):
    one = campaign(tmp_path, "ur10e")
    repeats = scatter_of_repeats(one.fit)
    alone = refit(one.fit, repeats, 320, 7)
    for processes in (1, 2, 3):
        with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
            together = refit(one.fit, repeats, 320, 7, pool.map)
        assert together.moves.tobytes() == alone.moves.tobytes()
        assert together.n_unsettled == alone.n_unsettled


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    one = campaign(tmp_path_factory.mktemp("sound"), "staubli_tx60")
    return evaluate(one.bundle, one.fit.result, one.bundle.measurements.joints[:2],
                    Settings(draws=1000, refits=300))  # fmt: skip


def test_refits_that_scatter_as_stated_are_said_to_agree(sound):
    verdict = judge_refits(sound, sound.refits)
    assert verdict.agree
    assert "linearising is good here" in verdict.sentence


def test_a_scatter_beyond_chance_is_told_with_the_parameter_that_shows_it(sound):
    worst = int(sound.result.free[3])
    std = sound.refits.std.copy()
    std[worst] *= 1.5
    verdict = judge_refits(sound, replace(sound.refits, std=std))
    assert not verdict.agree
    assert f"{sound.result.cell.names[worst]} scatters 1." in verdict.sentence
    assert "use the intervals of the refits" in verdict.sentence


def test_a_mean_off_beyond_chance_is_told(sound):
    worst = int(sound.result.free[5])
    bias = sound.refits.bias + 0.5 * sound.parameters.std * np.eye(len(sound.refits.bias))[worst]
    verdict = judge_refits(sound, replace(sound.refits, bias=bias))
    assert not verdict.agree
    assert f"{sound.result.cell.names[worst]} is off by " in verdict.sentence
