"""Which rows are left out once the causes are in the model, and what is said of them."""

import csv
import json

import pytest

from tests.robocal.diagnosis.hidden_cases import ROOT, STAUBLI, run_diagnose, write_cases

SCARA = ROOT / "robocal" / "robots" / "abb_irb910sc.yaml"
MASSES = "links:\n" + 4 * "  - {mass_kg: 3, com_mm: [0, 10, 20]}\n"


@pytest.fixture
def case(tmp_path):
    """The bundle of one hidden case."""

    def make(robot, effect, seed, index, *more):
        drawn = ("--kind", "one", "--effect", effect, "--seed", str(seed))
        count = ("--count", str(index + 1))
        cases = write_cases(tmp_path / "cases", *drawn, *count, *more, robot=robot)
        return cases / f"{index:04d}"

    return make


@pytest.fixture
def diagnose(call, tmp_path):
    """Diagnose a bundle; give diagnosis.json and report.html."""

    def run(bundle):
        out = tmp_path / "out"
        run_diagnose(call, bundle, out)
        return json.loads((out / "diagnosis.json").read_text()), (out / "report.html").read_text()

    return run


def push(bundle, lines, millimetres):
    """Move the target of some lines."""
    path = bundle / "measurements.csv"
    with path.open(newline="") as file:
        header, *rows = csv.reader(file)
    x = header.index("x_mm")
    for line in lines:
        rows[line - 2][x] = str(float(rows[line - 2][x]) + millimetres)
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([header, *rows])


def outliers(document):
    return [line for fault in document["data_faults"] for line in fault["lines"]]


def test_outliers_beside_a_settling_joint_are_found_in_few_poses(case, diagnose):
    few = ("--poses", "30", "--repeats", "0", "--check", "0", "--size", "2")
    bundle = case(STAUBLI, "settling", 91, 1, *few)
    push(bundle, (9, 22), 0.6)
    document, page = diagnose(bundle)
    assert outliers(document) == [9, 22]
    assert [row["line"] for row in document["rejected_rows"]] == [2]
    assert "line 2 not used: a joint may settle" in page


def test_a_row_that_carries_much_of_the_fit_is_no_outlier(case, diagnose, tmp_path):
    robot = tmp_path / "scara.yaml"
    robot.write_text(SCARA.read_text() + MASSES)
    bundle = case(robot, "tool_step", 6, 21, "--size", "3", "--poses", "40")
    document, _ = diagnose(bundle)
    assert [effect["effect"] for effect in document["effects"]] == ["tool_step"]
    assert outliers(document) == []
