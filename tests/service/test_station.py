"""`robocal station` judges the rows it is given as `robocal identify` does.

A UR5e is identified from 80 full poses, then measured in another base frame with another tool.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.extended import FittedEffect
from robocal.formats.bundle import read_bundle
from robocal.formats.model_yaml import read_model, write_model
from tests.elementary_kinematics import random_frame
from tests.measured_cell import Cell, measure, true_cell, write_bundle
from tests.spoilt_bundle import cell as csv_cell

ROBOT = "ur5e"


@pytest.fixture(scope="module")
def cells() -> tuple[Cell, Cell]:
    """The robot where it was identified, and where it stands now."""
    learnt, rng = true_cell(ROBOT, 7), np.random.default_rng(11)
    there = learnt.true.within(random_frame(rng, 2.0), random_frame(rng, 0.1))
    return learnt, replace(learnt, true=there)


@pytest.fixture(scope="module")
def learnt_bundle(cells, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("learnt")
    write_bundle(folder, ROBOT, cells[0], 80, 7)
    return folder


@pytest.fixture
def model(learnt_bundle, call, tmp_path) -> Path:
    assert call("identify", learnt_bundle, "--out", tmp_path / "learnt")[0] == 0
    return tmp_path / "learnt" / "model.yaml"


@pytest.fixture
def bundle(cells, tmp_path) -> Path:
    """40 positions at the new station."""
    write_bundle(tmp_path / "there", ROBOT, cells[1], 40, 8, full_pose=False)
    return tmp_path / "there"


def verdict(folder: Path) -> str:
    return yaml.safe_load((folder / "model.yaml").read_text())["provenance"]["adequacy"]["verdict"]


def base_of(folder: Path) -> np.ndarray:
    """Place of the robot's base in the measuring frame [m]."""
    return read_model(folder / "model.yaml").model.base_frame[:3, 3]


def exchange_columns(folder: Path, one: int, other: int) -> None:
    table = folder / "measurements.csv"
    head, *rows = [line.split(",") for line in table.read_text().splitlines()]
    for row in rows:
        row[one], row[other] = row[other], row[one]
    table.write_text("\n".join(map(",".join, [head, *rows])) + "\n")


def test_a_sound_bundle_gives_an_adequate_model_and_says_so(model, bundle, call, tmp_path):
    status, printed, said = call("station", model, bundle, "--out", tmp_path)
    assert (status, said) == (0, "")
    document = json.loads((tmp_path / "station.json").read_text())
    assert document["adequacy"]["verdict"] == verdict(tmp_path) == "adequate"
    assert document["adequacy"]["sentence"] in printed


def test_a_slip_of_the_columns_is_refused_with_its_mend(model, bundle, call, tmp_path):
    exchange_columns(bundle, 2, 4)
    status, _, said = call("station", model, bundle, "--out", tmp_path / "out")
    assert (status, said.count("\n")) == (2, 1)
    assert "columns j3_deg and j5_deg are exchanged: exchange them back" in said
    assert not (tmp_path / "out").exists()


def test_rows_of_a_robot_with_other_lengths_are_refused(model, call, tmp_path):
    """Its own robot.yaml would fit them: the model does not."""
    write_bundle(tmp_path / "other", "ur10e", true_cell("ur10e", 3), 60, 3)
    status, _, said = call("station", model, tmp_path / "other", "--out", tmp_path / "out")
    assert (status, said.count("\n")) == (3, 1)
    assert "the data do not fit robot" in said


def test_a_robot_with_other_joints_is_refused_in_one_sentence(model, call, tmp_path):
    write_bundle(tmp_path / "other", "kuka_iiwa14", true_cell("kuka_iiwa14", 3), 40, 3)
    status, _, said = call("station", model, tmp_path / "other", "--out", tmp_path / "out")
    assert (status, said.count("\n")) == (2, 1)
    assert "has 7 joints" in said
    assert "with 6 joints; give a bundle measured on that robot" in said


def test_a_row_that_is_off_is_left_out_and_named(model, bundle, call, tmp_path):
    """The base is what the other rows alone give."""
    assert call("station", model, bundle, "--out", tmp_path / "sound")[0] == 0
    line = int(read_bundle(bundle).measurements.fit_rows.lines[4])
    x = float((bundle / "measurements.csv").read_text().splitlines()[line - 1].split(",")[6])
    csv_cell(line, 6, f"{x + 100.0}")(bundle)
    status, printed, _ = call("station", model, bundle, "--out", tmp_path / "spoilt")
    assert status == 0
    assert f"measurements.csv line {line} not used: outlier" in printed
    document = json.loads((tmp_path / "spoilt" / "station.json").read_text())
    assert [row["line"] for row in document["rejected_rows"]] == [line]
    sound, spoilt = (base_of(tmp_path / name) for name in ("sound", "spoilt"))
    # One row of 30 less, of 0.02 mm noise.
    assert np.linalg.norm(sound - spoilt) < 2e-5
    assert verdict(tmp_path / "spoilt") == "adequate"


def test_a_model_is_no_more_adequate_than_its_rows_are(cells, model, call, tmp_path):
    write_bundle(tmp_path / "loud", ROBOT, cells[1], 60, 8, noise=3.0)
    status, printed, _ = call("station", model, tmp_path / "loud", "--out", tmp_path / "out")
    assert status == 0
    assert verdict(tmp_path / "out") == "inadequate"
    assert "the model leaves more than the declared noise" in printed


def test_an_inadequate_model_stays_so_on_sound_rows(model, bundle, call, tmp_path):
    model.write_text(model.read_text().replace("verdict: adequate", "verdict: inadequate"))
    assert call("station", model, bundle, "--out", tmp_path / "out")[0] == 0
    assert verdict(tmp_path / "out") == "inadequate"


def test_lengths_among_the_positions_are_used(cells, model, call, tmp_path):
    """Every second row is a length: the other half alone has fewer numbers than are used."""
    folder, cell = tmp_path / "mixed", cells[1]
    q = write_bundle(folder, ROBOT, cell, 60, 8, full_pose=False)
    rng = np.random.default_rng(5)
    place = measure(cell.true, q, rng)[0]
    anchor = np.array([0.2, -0.3, 0.1])
    lengths = np.linalg.norm(place - anchor, axis=1) * 1e3
    head, *rows = (folder / "measurements.csv").read_text().splitlines()
    for k in range(0, 60, 2):
        rows[k] = ",".join([*rows[k].split(",")[:6], "", "", "", f"{lengths[k]:.6f}"])
    rows = [row if row.count(",") == 9 else f"{row}," for row in rows]
    (folder / "measurements.csv").write_text("\n".join([f"{head},distance_mm", *rows]) + "\n")
    with (folder / "campaign.yaml").open("a") as file:
        file.write("anchor: {xyz_mm: [200, -300, 100]}\n")
    status, printed, _ = call("station", model, folder, "--out", tmp_path / "out", "--json")
    assert status == 0
    document = json.loads(printed)
    assert document["fit"]["rows"] + len(document["rejected_rows"]) == 45
    assert document["adequacy"]["verdict"] == "adequate"
    assert 0 < document["held_out"]["position_rms_mm"] < 0.1
    # Nominal base and joint 1 differ by the 0.4 mm by which its link is off.
    assert np.linalg.norm(base_of(tmp_path / "out") - cell.true.base[:3, 3]) < 2e-3


@pytest.fixture
def station_few(cells, model, call, tmp_path):
    """Station the model on so many positions, none held out."""

    def station(rows):
        write_bundle(tmp_path / "few", ROBOT, cells[1], rows, 9, full_pose=False)
        with (tmp_path / "few" / "campaign.yaml").open("a") as file:
            file.write("held_out: {fraction: 0}\n")
        return call("station", model, tmp_path / "few", "--out", tmp_path / "out")

    return station


def test_five_positions_are_enough_for_base_and_tool(station_few):
    status, printed, _ = station_few(5)
    assert status == 0
    assert "only 6 measured numbers are left over to judge the model by" in printed


def test_two_positions_are_too_few_for_base_and_tool(station_few):
    status, _, said = station_few(2)
    assert status == 2
    assert "give 6 numbers for 9 parameters; measure at least 3 different poses" in said


def test_a_column_that_an_effect_of_the_model_needs_is_asked_for(model, bundle, call, tmp_path):
    growth = Instance("thermal_expansion", None, (), (Coefficient("expansion_per_k", 1e-5),))
    effect = FittedEffect(growth, np.array([1e-5]), np.eye(1) * 1e-12)
    write_model(model, replace(read_model(model), effects=(effect,)))
    status, _, said = call("station", model, bundle, "--out", tmp_path / "out")
    assert (status, said.count("\n")) == (2, 1)
    assert "measurements.csv line 2: lacks temperature_degc, which the model's effects need" in said
