"""Clean data, still joints, few rows: what no cause explains is told for what it is."""

import json

import numpy as np
import pytest

from robocal.diagnosis.select import select_effects
from tests.measured_cell import CAMPAIGN, header, measure, true_cell, write_bundle
from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases

ROBOT = "ur10e"
HELD_OUT = "held_out: {column: split}\n"


@pytest.fixture
def found(call, tmp_path):
    """Diagnose positions of a cell; `still` joints stand, every pose is read `times` times."""

    def diagnose(seed, poses=60, times=1, still=(), moved=lambda q: q, noise=1.0, checked=4):
        bundle, cell = tmp_path / "bundle", true_cell(ROBOT, seed)
        q = write_bundle(bundle, ROBOT, cell, poses, full_pose=False)
        q[:, still] = 0.3
        q, pose = np.repeat(q, times, axis=0), np.repeat(np.arange(poses), times)
        position, _ = measure(cell.true, moved(q), np.random.default_rng(seed), noise)
        lines = [",".join([*header(cell.nominal, full_pose=False), "pose", "split"])]
        for reading, place, number in zip(np.degrees(q), position * 1e3, pose, strict=True):
            numbers = ",".join(f"{value:.9f}" for value in (*reading, *place))
            lines.append(
                f"{numbers},{number},{'check' if number % checked == checked - 1 else 'fit'}"
            )
        (bundle / "measurements.csv").write_text("\n".join(lines) + "\n")
        (bundle / "campaign.yaml").write_text(CAMPAIGN + HELD_OUT)
        printed = run_diagnose(call, bundle, tmp_path / "out")
        return printed, json.loads((tmp_path / "out" / "diagnosis.json").read_text())

    return diagnose


@pytest.mark.parametrize("seed", [2, 4])
def test_a_joint_that_stood_still_is_nothing_that_residuals_depend_on(found, seed):
    _, clean = found(seed, poses=80, still=[3])
    assert clean["depends_on"] == []
    assert clean["verdict"] in {"model_adequate", "explained"}
    told = [cause for effect in clean["effects"] for cause in (effect, *effect["confusable_with"])]
    # Noise may look like something, but not like a joint that settles where it stood.
    assert ("settling", 4) not in {(cause["effect"], cause.get("joint")) for cause in told}


def test_repeats_that_scatter_more_than_declared_say_that_the_noise_is_stated_too_small(found):
    printed, noisy = found(3, times=3, noise=1.6)
    repeats = noisy["pure_error"]
    assert repeats["degrees_of_freedom"] == 2 * 45 * 3
    assert repeats["variance_over_declared"] == pytest.approx(1.6**2, rel=0.3)
    assert repeats["contradicts_declared"]
    assert repeats["lack_of_fit_p"] > 0.01
    assert "lack of fit against repeats (270 degrees of freedom)" in printed
    assert "repeats of one pose scatter by 1." in printed
    assert "nothing of the catalogue" not in printed


def test_a_geometry_that_lacks_something_does_not_fit_the_means_of_its_repeats(found):
    def bent(q):
        q = q.copy()
        q[:, 2] += 4e-4 * np.sin(q[:, 2])
        return q

    printed, lacking = found(3, times=3, moved=bent)
    assert lacking["effects"][0]["effect"] == "gear_harmonic"
    repeats = lacking["pure_error"]
    assert not repeats["contradicts_declared"]
    assert repeats["geometry_lack_of_fit_p"] < 1e-6
    assert repeats["lack_of_fit_p"] > 0.01
    assert "scatter" not in printed


def test_without_repeats_nothing_is_said_of_them(found):
    assert found(3)[1]["pure_error"] is None


@pytest.mark.parametrize(("poses", "noise"), [(14, 1.0), (16, 30.0)])
def test_hardly_more_numbers_than_parameters_name_no_cause(found, poses, noise):
    printed, few = found(7, poses=poses, noise=noise)
    assert few["effects"] == []
    assert "explains" not in printed
    assert "measure at least" in printed


@pytest.mark.parametrize("held_out", ["{column: split}", "{fraction: 0.0}"])
def test_a_single_cause_gains_what_the_whole_model_gains(call, tmp_path, held_out):
    case = ("--kind", "one", "--effect", "base_step", "--seed", "11")
    bundle = write_cases(tmp_path / "cases", *case) / "0000"
    campaign = bundle / "campaign.yaml"
    campaign.write_text(campaign.read_text().replace("{column: split}", held_out))
    assert held_out in campaign.read_text()
    run_diagnose(call, bundle, tmp_path / "out")
    document = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    (cause,) = document["effects"]
    for name in ("held_out_rms_before_mm", "held_out_rms_after_mm"):
        assert cause["gain"][name] == pytest.approx(document["gain"][name], rel=1e-3)


def test_two_orders_of_one_gear_are_taken_out_one_by_one(found):
    """Folds that choose again find each order a little elsewhere."""

    def geared(q):
        q = q.copy()
        q[:, 1] += 1e-4 * (np.sin(20.3 * q[:, 1]) + np.sin(33.7 * q[:, 1]))
        return q

    _, both = found(5, poses=120, moved=geared, checked=1000)
    orders = {round(entry["order"]): entry["gain"]["reduction"] for entry in both["effects"]}
    assert set(orders) == {20, 34}
    assert min(orders.values()) > 0.5


def test_rows_that_chose_a_cause_do_not_measure_its_gain(call, tmp_path, monkeypatch):
    case = ("--kind", "one", "--effect", "base_step", "--seed", "11", "--poses", "60")
    bundle = write_cases(tmp_path / "cases", *case) / "0000"
    campaign = bundle / "campaign.yaml"
    campaign.write_text(campaign.read_text().replace("{column: split}", "{fraction: 0.0}"))
    chose = []

    def choose(problem, start, rows, limits):
        chose.append(rows.lines)
        return select_effects(problem, start, rows, limits)

    monkeypatch.setattr("robocal.diagnosis.unseen.select_effects", choose)
    run_diagnose(call, bundle, tmp_path / "out")
    all_lines = set(np.concatenate(chose).tolist())
    left_out = [all_lines - set(lines.tolist()) for lines in chose]
    assert len(chose) == 5
    assert set.union(*left_out) == all_lines
    assert sum(map(len, left_out)) == len(all_lines)
