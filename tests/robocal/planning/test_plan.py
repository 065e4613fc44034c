import csv
import json
from xml.etree import ElementTree

import numpy as np
import pytest
from typer.testing import CliRunner

from robocal.errors import BadInput, NoAnswer
from robocal.planning.cell import Cell
from robocal.planning.cell_yaml import read_cell
from robocal.planning.plan import make_plan, plan_poses
from robocal.planning.request import PlanRequest
from service.cli import app

CELL = """\
box_mm: {low: [0, -500, 100], high: [700, 500, 900]}
floor_mm: -300
link_radius_mm: 40
tracker: {xyz_mm: [2500, 0, 800], range_mm: [300, 20000], facing: [0, 0, 1], acceptance_deg: 75}
instrument: {sigma_mm: 0.02, sigma_ppm: 5, sees: pose}
repeatability: {sigma_mm: 0.01}
workspace_mm: {low: [100, -300, 200], high: [500, 300, 600]}
payloads_kg: [0, 2.5]
"""


@pytest.fixture
def cell_file(tmp_path):
    path = tmp_path / "cell.yaml"
    path.write_text(CELL)
    return path


def run(*arguments):
    return CliRunner().invoke(app, ["plan", *map(str, arguments)])


def test_the_command_writes_visits_curve_and_picture(tmp_path, cell_file):
    out = tmp_path / "out"
    done = run("staubli_tx60", "--out", out, "--cell", cell_file, "--count", 12, "--repeats", 4,
               "--candidates", 150, "--approach", "--json")  # fmt: skip
    assert done.exit_code == 0, done.exception
    document = json.loads((out / "plan.json").read_text())
    assert json.loads(done.stdout) == document
    assert (document["count"], document["visits"]) == (12, 16)
    assert document["curve"]["count"][0] == 5
    assert len(document["curve"]["indices"]["O5"]["mean"]) == len(document["curve"]["count"])
    assert 0.8 < document["index_share_of_bound"] <= 1.0
    rows = list(csv.DictReader((out / "plan.csv").read_text().splitlines()))
    assert len(rows) == 16
    assert sorted({int(row["pose"]) for row in rows}) == list(range(1, 13))
    masses = [row["payload_kg"] for row in rows]
    assert masses == sorted(masses)
    assert sum(row["repeat"] == "2" for row in rows) == 4
    by_pose = {row["pose"]: row for row in rows if row["repeat"] == "1"}
    for row in rows:
        assert row | {"repeat": "1"} == by_pose[row["pose"]]
    drawing = ElementTree.parse(out / "plan.svg").getroot()
    circles = drawing.iter("{http://www.w3.org/2000/svg}circle")
    assert len([c for c in circles if c.get("r") == "3.5"]) == 2 * 16


def test_the_same_command_writes_the_same_files(tmp_path):
    for name in ("one", "other"):
        run("staubli_tx60", "--out", tmp_path / name, "--count", 10, "--candidates", 60)
    for file in ("plan.csv", "plan.json", "plan.svg"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "other" / file).read_bytes()


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        (("--count", "many"), BadInput, "whole number or auto"),
        (("--count", "0"), BadInput, "whole number or auto"),
        (("--count", "60", "--candidates", "60"), BadInput, "not less than the 60 candidates"),
        (("--count", "8"), NoAnswer, "24 numbers for 27 parameters; plan at least 9"),
        (("--index", "O6"), BadInput, "known are O1, O2, O3, O4, O5, workspace"),
        (("--selector", "best"), BadInput, "known are detmax, exchange, relaxed, random"),
        (("--selector", "relaxed", "--index", "O2"), BadInput, "knows O1 only"),
        (("--index", "O3",), NoAnswer, "O3 has not settled"),
    ],
)  # fmt: skip
def test_a_request_that_cannot_be_met_says_why(tmp_path, arguments, error, words):
    done = run("staubli_tx60", "--out", tmp_path, "--candidates", 100, *arguments)
    assert isinstance(done.exception, error)
    assert words in str(done.exception)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("flor_mm: 3", "line 1: field 'flor_mm' is not known; did you mean 'floor_mm'"),
        ("box_mm: {low: [0, 0, 0], high: [1, 1, 0]}", "line 1: field 'box_mm' has a lower corner"),
        ("link_radius_mm: 0", "must be positive"),
        ("tracker: {xyz_mm: [1, 2]}", "field 'tracker.xyz_mm' must have 3 numbers"),
        ("tracker: {xyz_mm: [1, 2, 3], facing: [0, 0, 0]}", "must not be zero"),
        ("instrument: {sigma_mm: -1}", "field 'instrument.sigma_mm' must be positive"),
        ("instrument: {sees: all}", "must be position or pose, not 'all'"),
        ("payloads_kg: [5, 0]", "the lighter first"),
    ],
)
def test_a_cell_file_with_a_slip_names_line_and_field(tmp_path, text, words):
    path = tmp_path / "cell.yaml"
    path.write_text(text + "\n")
    with pytest.raises(BadInput) as refusal:
        read_cell(path)
    assert words in str(refusal.value)


def test_a_cell_file_is_read_in_si_units(cell_file):
    cell = read_cell(cell_file)
    assert cell.box.low == pytest.approx((0.0, -0.5, 0.1))
    assert cell.workspace.high == pytest.approx((0.5, 0.3, 0.6))
    assert cell.floor == pytest.approx(-0.3)
    assert cell.station.acceptance == pytest.approx(np.radians(75))
    assert (cell.noise.fixed, cell.noise.repeatability) == pytest.approx((2e-5, 1e-5))
    assert cell.sees_orientation
    assert cell.payloads == (0.0, 2.5)


def test_a_floor_can_be_denied(tmp_path):
    path = tmp_path / "cell.yaml"
    path.write_text("floor: false\n")
    assert read_cell(path).floor is None


def test_the_plan_of_the_service_is_in_limits_repeatable_and_better_than_chance(tx60):
    q = plan_poses(tx60, 20, 5)
    assert q.shape == (20, 6)
    assert np.array_equal(q, plan_poses(tx60, 20, 5))
    assert ((q > tx60.limits[:, 0]) & (q < tx60.limits[:, 1])).all()


@pytest.mark.parametrize("count", [1, 3, 9])
def test_the_service_may_ask_for_fewer_poses_than_parameters_need(tx60, count):
    assert plan_poses(tx60, count, 1).shape == (count, 6)


def test_the_number_comes_from_the_curve_or_from_the_uncertainty(tx60):
    def planned(**what):
        return make_plan(PlanRequest(tx60, Cell(), "O1", "exchange", 150, 1, **what))

    settled = planned()
    assert len(settled.chosen) == settled.curve.settled_count("O1")
    wanted = 0.8 * float(settled.radius.max())
    enough = planned(uncertainty=wanted)
    assert len(enough.chosen) > len(settled.chosen)
    assert enough.radius.max() <= wanted
