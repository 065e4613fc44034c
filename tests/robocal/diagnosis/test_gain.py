"""What a cause gains is measured on rows that chose nothing."""

import json

import numpy as np
import pytest

from robocal.diagnosis.select import select_effects
from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases


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
