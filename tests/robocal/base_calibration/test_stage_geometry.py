"""The stage's cups and derivatives, against elementary geometry, differences and the paper."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from robocal.base_calibration.corrections import CORRECTIONS
from robocal.base_calibration.equations import build_equations, touch_rows
from robocal.base_calibration.stage import Readings, Stage, cup_positions
from robocal.base_calibration.state import State
from tests.robocal.base_calibration.stage_cell import (
    TILTED_CELL,
    Faults,
    Plan,
    frame,
    simulate,
    true_cups,
    wide_plan,
)

WRONG = Faults(1e-3, 0.1e-3, 1e-4, 2e-4, 1e-3, 3e-4, 2e-4, 0.3e-3)
ALL = np.array([getattr(WRONG, correction.name) for correction in CORRECTIONS])
STAGE = Stage(0.05e-3, 0.02e-3, 0.1e-3, level_in_master=False, level_in_slave=False)
CELL = TILTED_CELL


@pytest.fixture
def noiseless():
    exact = replace(CELL, sigma_tip=0.0, sigma_slide=0.0, sigma_rod=0.0, sigma_angle=0.0)
    touches = simulate(exact, wide_plan(), WRONG, np.random.default_rng(0))
    return replace(touches, tip_covariance=np.eye(3 * len(touches)) * 1e-10)


def test_cups_lie_where_elementary_rotations_put_them(noiseless):
    plan, R = wide_plan(), CELL.stages[0][:3, :3]
    up = np.tile(R[2], (len(noiseless), 1))
    cups = cup_positions(noiseless.readings, plan.on_rod, ALL, up, noiseless.rod_reference)
    expected = true_cups(CELL, plan, WRONG)
    np.testing.assert_allclose(cups @ R.T + CELL.stages[0][:3, 3], expected, atol=1e-12)


def test_the_true_cell_closes_every_touch(noiseless):
    truth = State(np.array(CELL.stages), CELL.slave, ALL)
    assert np.abs(touch_rows(truth, noiseless).misclosure).max() < 1e-12


@pytest.mark.parametrize("levels", [(False, False), (True, False), (False, True), (True, True)])
def test_the_jacobian_agrees_with_central_differences(noiseless, levels):
    stage = replace(STAGE, level_in_master=levels[0], level_in_slave=levels[1])
    state = State(np.array(CELL.stages), CELL.slave, ALL)
    equations = build_equations(state, noiseless, stage)
    n, step = equations.n_coordinates, 1e-6
    analytic = touch_rows(state, noiseless).J.reshape(n, -1)
    for unknown in range(state.size):
        move = np.zeros(state.size)
        move[unknown] = step
        plus, minus = (build_equations(state.moved(m), noiseless, stage) for m in (move, -move))
        touched = (plus.misclosure - minus.misclosure).ravel() / (2 * step)
        np.testing.assert_allclose(analytic[:, unknown], touched, atol=1e-8)
        other = (plus.residual[n:] - minus.residual[n:]) / (2 * step)
        # Levels and priors are whitened: 1e-8 of a unit is 1e-4 of 0.1 mrad.
        np.testing.assert_allclose(equations.J[n:, unknown], other, rtol=1e-6, atol=1e-4)


def test_the_derivatives_by_readings_agree_with_central_differences(noiseless):
    state = State(np.array(CELL.stages), CELL.slave, ALL)
    analytic = touch_rows(state, noiseless).by_reading
    for kind, name in enumerate(("slide", "angle", "length")):
        sides = []
        for step in (1e-6, -1e-6):
            moved = replace(noiseless.readings, **{name: getattr(noiseless.readings, name) + step})
            up = np.tile(state.stages[0][2, :3], (len(noiseless), 1))
            cups = cup_positions(moved, noiseless.on_rod, ALL, up, noiseless.rod_reference)
            sides.append(cups @ state.stages[0][:3, :3].T)
        difference = (sides[0] - sides[1]) / 2e-6
        np.testing.assert_allclose(analytic[:, :, kind], difference, atol=1e-8)


def test_the_paper_s_readings_lead_from_its_master_touches_to_its_slave_touches():
    """Printed to four digits: the readings carry 5e-5 m and 5e-5 rad on arms of 4.4 m."""
    path = Path(__file__).parents[2] / "reference" / "zhong_2022_stage.yaml"
    printed = yaml.safe_load(path.read_text(encoding="utf-8"))["experiment_1"]
    p1, p2 = np.array(printed["P1_m"]), np.array(printed["P2_m"])
    u = (p2 - p1) / np.linalg.norm(p2 - p1)
    w = np.cross([0, 0, 1], u)
    readings = Readings(
        np.full(2, printed["E_m"]), np.array(printed["theta_rad"]), np.array(printed["length_m"])
    )
    up = np.tile([0.0, 0.0, 1.0], (2, 1))
    cups = cup_positions(readings, np.ones(2, dtype=bool), np.zeros(8), up, 4.4)
    found = p2 + cups @ np.array([u, w, np.cross(u, w)])
    slave = frame(printed["slave_xyz_m"], [0, 0, np.deg2rad(printed["slave_yaw_deg"])])
    expected = np.array([printed["R1_m"], printed["R2_m"]]) @ slave[:3, :3].T + slave[:3, 3]
    np.testing.assert_allclose(found, expected, atol=3e-4)


def test_a_reading_that_stands_in_several_rows_is_one_reading():
    plan = Plan.of([(0, 1, 0.2, 0.0, 0.5), (0, 0, 0.2, 0, 0), (1, 1, 0.2, 0.4, 0.5)])
    exact = replace(CELL, sigma_slide=0.0, sigma_rod=0.0)
    touches = simulate(exact, plan, Faults(), np.random.default_rng(0))
    groups, kinds = touches.reading_groups()
    assert groups[:, 0].tolist() == [0, 0, 0]
    assert groups[0, 2] == groups[2, 2]
    assert groups[0, 1] != groups[2, 1]
    assert groups[1, 1:].tolist() == [-1, -1]
    assert sorted(kinds) == [0, 1, 1, 2]
