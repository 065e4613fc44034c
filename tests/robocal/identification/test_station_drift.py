"""Fixed nests that show no drift, and those that would hide it."""

import json
from pathlib import Path

import numpy as np
import pytest

from robocal.formats.bundle import read_bundle
from robocal.identification.station_drift import find_drift
from tests.measured_cell import true_cell, write_bundle

NESTS = {"r1": (2000.0, 0.0, 0.0), "r2": (2000.0, 1000.0, 200.0)}
REASON = "a fixed nest of one visit alone shows no drift"


def with_fixed_rows(folder: Path, visits: dict[int, dict[str, float]]) -> Path:
    """60 full poses, and before the numbered ones rows of fixed nests, all moved along x [mm]."""
    write_bundle(folder, "ur5e", true_cell("ur5e", 1), 60)
    head, *rows = (folder / "measurements.csv").read_text().splitlines()
    lines = [f"{head},target"]
    for number, row in enumerate(rows):
        joints = row.split(",")[:6]
        for name, shift in visits.get(number, {}).items():
            x, y, z = NESTS[name]
            lines.append(",".join([*joints, f"{x + shift}", f"{y}", f"{z}", "", "", "", "", name]))
        lines.append(f"{row},")
    (folder / "measurements.csv").write_text("\n".join(lines) + "\n")
    with (folder / "campaign.yaml").open("a") as file:
        file.write("targets: {r1: {fixed: true}, r2: {fixed: true}}\n")
    return folder


@pytest.mark.parametrize("command", ["identify", "diagnose", "uncertainty"])
def test_fixed_nests_of_one_visit_are_named_by_line(tmp_path, call, command):
    bundle = with_fixed_rows(tmp_path / "b", {0: {"r1": 0.0, "r2": 0.0}})
    quick = ("--draws", 1000, "--refits", 0) if command == "uncertainty" else ()
    status, printed, _ = call(command, bundle, "--out", tmp_path, *quick)
    assert status == 0
    name = {"identify": "identification", "diagnose": "diagnosis"}.get(command, command)
    named = json.loads((tmp_path / f"{name}.json").read_text())["rejected_rows"]
    assert [row["line"] for row in named] == [2, 3]
    assert all(REASON in row["reason"] for row in named)
    for line in (2, 3):
        assert f"measurements.csv line {line} not used: {REASON}" in printed


def test_taking_a_robot_elsewhere_names_them_too(tmp_path, call):
    bundle = with_fixed_rows(tmp_path / "b", {5: {"r1": 0.0}})
    assert call("identify", bundle, "--out", tmp_path)[0] == 0
    command = ("station", tmp_path / "model.yaml", bundle, "--out", tmp_path / "there")
    assert f"measurements.csv line 7 not used: {REASON}" in call(*command)[1]
    document = json.loads((tmp_path / "there" / "station.json").read_text())
    assert [row["line"] for row in document["rejected_rows"]] == [7]


def test_a_visit_that_an_unusable_row_cuts_in_two_is_still_one(tmp_path):
    bundle = with_fixed_rows(tmp_path, {5: {"r1": 0.0, "r2": 0.0}})
    table = tmp_path / "measurements.csv"
    lines = table.read_text().splitlines()
    spoilt = lines[6].replace("2000.0", "", 1)
    table.write_text("\n".join([*lines[:6], lines[6], spoilt, *lines[6:]]) + "\n")
    rejected = {row.line: row.reason for row in read_bundle(bundle).rejected}
    assert rejected.pop(8) == "a coordinate of the position is missing"
    assert sorted(rejected) == [7, 9, 10]


def test_nests_of_two_visits_are_kept(tmp_path):
    seen = {"r1": 0.0, "r2": 0.0}
    bundle = read_bundle(with_fixed_rows(tmp_path, {0: seen, 59: seen}))
    assert bundle.rejected == ()
    assert len(bundle.measurements) == 64


def test_a_nest_of_one_visit_does_not_hide_the_drift_that_another_shows(tmp_path):
    """Its place is its own mean, so it would say that the station stood still."""
    late = {"r1": 0.3, "r2": 0.3}
    bundle = read_bundle(with_fixed_rows(tmp_path, {0: {"r1": 0.0}, 59: late}))
    fixed = np.array([name in NESTS for name in bundle.measurements.target])
    drift = find_drift(bundle.measurements, fixed, bundle.instrument)
    assert drift.largest == pytest.approx(3e-4, rel=1e-6)
