"""What a diagnosis' residuals are drawn over."""

import re
from dataclasses import replace

import numpy as np
import pytest

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.diagnosis import RowResiduals
from service.diagnosis_covariates import covariates_of
from service.diagnosis_plots import covariate_plots
from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases
from tests.robocal.diagnosis.test_effects import arm_and_rows, seen

OF_JOINTS = {f"{name} {j}" for name in ("joint", "approach", "move") for j in range(1, 7)}
OF_ALL = {"time", "temperature", "payload", "speed", "reach"}
OF_TOOL = {"tool tilt", "tool heading", "tool to beam"}
TORQUES = {f"torque {joint}" for joint in range(2, 7)}


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("yields")
    chosen = ("--kind", "one", "--effect", "joint_compliance", "--seed", "7", "--count", "1")
    return write_cases(folder, *chosen) / "0000"


def test_the_report_shows_residuals_over_every_covariate_of_the_issue(call, case, tmp_path):
    run_diagnose(call, case, tmp_path)
    report = (tmp_path / "report.html").read_text()
    drawn = set(re.findall(r'aria-label="residual over ([^[" ]+(?: [^[" ]+)*)', report))
    assert drawn == OF_JOINTS | OF_ALL | OF_TOOL | TORQUES
    assert len(report) < 60_000


def points(plot: str) -> list[int]:
    """How many points the lines before and after have."""
    return [len(line.split()) for line in re.findall(r'points="([^"]*)"', plot)]


def test_a_covariate_of_three_values_is_drawn_by_value_and_without_the_rows_that_lack_it():
    size = np.array([1.0, 1.0, 2.0, 2.0, 4.0, 4.0, 9.0])
    rows = RowResiduals(np.arange(7), np.zeros(7, dtype=bool), size, size / 2)
    approach = np.array([-1.0, -1.0, 0.0, 0.0, 1.0, 1.0, np.nan])
    (plot,) = covariate_plots({"approach 1": approach}, rows)
    assert points(plot) == [3, 3]
    assert "4e+03 mm" in plot


def torques(rows: Circumstances) -> dict[str, np.ndarray]:
    return {name: values for name, values in covariates_of(rows).items() if "torque" in name}


def test_without_stated_masses_the_torque_is_the_loads_or_that_of_a_kilogram():
    known = seen(*arm_and_rows())
    unstated = replace(known, robot=replace(known.robot, masses=None))
    loaded, bare = torques(unstated), torques(replace(unstated, payload=np.full(len(known), 2.0)))
    assert set(loaded) == {f"load torque {joint} [N·m]" for joint in range(2, 7)}
    assert set(bare) == {f"torque {joint} [N·m/kg]" for joint in range(2, 7)}
    for joint in range(2, 7):
        a, b = loaded[f"load torque {joint} [N·m]"], bare[f"torque {joint} [N·m/kg]"]
        np.testing.assert_allclose(a, known.payload * b)
