"""Campaigns on robots whose truth is known, in any frames and without any guess."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from robocal.formats.bundle import Bundle, read_bundle
from robocal.identification.identify import identify
from robocal.identification.result import Identification
from robocal.identification.strategies import STRATEGIES
from robocal.kinematics.forward import forward_kinematics
from tests.elementary_kinematics import Arm, frame
from tests.many_fits import moved_links, position_covariance
from tests.measured_cell import (
    SIGMA_MRAD,
    Cell,
    position_sigma,
    true_cell,
    write_bundle,
)

ROOT = Path(__file__).parents[3]
SIX_AXIS = ("staubli_tx60", "ur10e", "abb_irb120", "ur5")
PRIOR_LENGTH, PRIOR_ANGLE = 1e-3, 5e-3
"""The design's priors on link parameters, one standard deviation [m, rad]"""


def bundle_of(folder, robot: str, cell: Cell, **options) -> Bundle:
    """Measured, written, and read back."""
    write_bundle(folder, robot, cell, **options)
    return read_bundle(folder)


def local_error(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """Shift and turn from the found to the true frame, along the found frame's axes."""
    between = np.linalg.inv(found) @ true
    return np.concatenate([between[:3, 3], Rotation.from_matrix(between[:3, :3]).as_rotvec()])


def turned_as_reported(error: np.ndarray) -> np.ndarray:
    """Shift and rotation vector as x, y, z, yaw, pitch, roll of a small frame."""
    return error[[0, 1, 2, 5, 4, 3]]


def parameter_error(result: Identification, cell: Cell) -> np.ndarray:
    """Found less true, over the free parameters, frames in their own axes."""
    links = (cell.true.links - result.model.links).ravel()
    base = turned_as_reported(local_error(result.base, cell.true.base))
    tool = turned_as_reported(local_error(result.tool, cell.true.tool))
    return np.concatenate([links, base, tool])[result.free]


def sighted_truth(folder, robot: str, seed: int, **options) -> tuple[Cell, Bundle]:
    """A cell that errs only in parameters that the data can tell apart, and its bundle."""
    nominal = true_cell(robot, seed, wrong=())
    pilot = identify(bundle_of(folder / "pilot", robot, nominal, seed=seed, **options))
    cell = true_cell(robot, seed, wrong=moved_links(pilot))
    return cell, bundle_of(folder / "real", robot, cell, seed=seed, **options)


@pytest.mark.parametrize("full_pose", [True, False], ids=["poses", "positions"])
@pytest.mark.parametrize("robot", SIX_AXIS)
def test_the_truth_is_found_within_the_stated_covariance(tmp_path, robot, full_pose):
    total, freedom = 0.0, 0
    for seed in range(3):
        cell, bundle = sighted_truth(
            tmp_path / str(seed), robot, seed + 10, rows=70, full_pose=full_pose
        )
        result = identify(bundle)
        assert result.converged
        error = parameter_error(result, cell)
        total += error @ np.linalg.solve(result.covariance, error)
        freedom += len(error)
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], freedom)
    assert low < total < high


@pytest.mark.parametrize("full_pose", [True, False], ids=["poses", "positions"])
def test_a_scara_goes_where_its_covariance_says(tmp_path, full_pose):
    """Parallel axes leave heights of base and tool open: poses are judged, not parameters."""
    total, q = 0.0, np.array([0.4, -0.7, 0.09, 1.2])
    for seed in range(5):
        cell, bundle = sighted_truth(
            tmp_path / str(seed), "abb_irb910sc", seed, rows=40, full_pose=full_pose
        )
        result = identify(bundle)
        error = (forward_kinematics(result.model, q[None]) - cell.true.poses(q[None]))[0, :3, 3]
        total += error @ np.linalg.solve(position_covariance(result, q), error)
    low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], 5 * 3)
    assert low < total < high


@pytest.mark.parametrize("full_pose", [True, False], ids=["poses", "positions"])
@pytest.mark.parametrize("robot", ["staubli_tx60", "ur3e", "abb_irb910sc"])
def test_residuals_are_near_the_noise_whatever_parameters_are_off(tmp_path, robot, full_pose):
    """Every one of the 5 n link parameters is off; the redundant ones must not matter."""
    cell = true_cell(robot, 5)
    q = write_bundle(tmp_path, robot, cell, rows=200, full_pose=full_pose)
    result = identify(read_bundle(tmp_path))
    noise = float(np.sqrt(3) * np.mean(position_sigma(cell.true.poses(q)[:, :3, 3])))
    assert result.fit.position_rms == pytest.approx(noise, rel=0.12)
    assert result.held_out.position_rms == pytest.approx(noise, rel=0.25)
    assert result.before.position_rms > 10 * noise
    # Over 500 degrees of freedom the reduced chi-square spreads by 6 %.
    assert result.adequacy.reduced_chi_square == pytest.approx(1.0, abs=0.2)
    if full_pose:
        assert result.fit.orientation_rms == pytest.approx(np.sqrt(3) * SIGMA_MRAD * 1e-3, rel=0.12)


@pytest.mark.parametrize("seed", range(12))
def test_any_base_and_tool_is_found_without_a_guess(tmp_path, seed):
    rng = np.random.default_rng(seed)
    cell = true_cell("ur10e", seed, tool_point=rng.uniform(-0.4, 0.4, 3))
    full_pose = seed % 2 == 0
    result = identify(bundle_of(tmp_path, "ur10e", cell, full_pose=full_pose))
    assert result.converged
    assert result.fit.position_rms < 60e-6
    assert np.linalg.norm(local_error(result.base, cell.true.base)[3:]) < 0.01


@pytest.mark.parametrize("robot", SIX_AXIS)
def test_a_six_axis_arm_has_30_parameters_in_poses_and_27_in_positions(tmp_path, robot):
    cell = true_cell(robot, 3)
    poses = identify(bundle_of(tmp_path / "poses", robot, cell))
    assert poses.rank == 30
    positions = identify(bundle_of(tmp_path / "positions", robot, cell, full_pose=False))
    assert positions.rank == 27


@pytest.mark.parametrize("full_pose", [True, False], ids=["poses", "positions"])
@pytest.mark.parametrize("tool_point", [(0.06, -0.04, 0.12), (0.0, 0.0, 0.12)], ids=["off", "on"])
@pytest.mark.parametrize("robot", ["staubli_tx60", "ur10e", "abb_irb910sc"])
def test_the_rank_is_that_of_the_poses_differences(tmp_path, robot, tool_point, full_pose):
    """The tool point on the last axis hides parameters; the singular values say how many."""
    cell = true_cell(robot, 4, tool_point=tool_point, wrong=())
    result = identify(bundle_of(tmp_path, robot, cell, full_pose=full_pose, noise=0.0))
    q = cell.nominal.draw(np.random.default_rng(1), 60, widest=2.5)
    sigma = np.linalg.svd(difference_jacobian(cell.true, q, full_pose=full_pose), compute_uv=False)
    # Differences are good to 1e-9, what is redundant lies below; the rest stands far above.
    rank = int(np.count_nonzero(sigma > 1e-6 * sigma[0]))
    assert sigma[rank - 1] > 100 * (sigma[rank] if rank < len(sigma) else 0.0)
    assert result.rank == rank


def difference_jacobian(arm: Arm, q: np.ndarray, *, full_pose: bool) -> np.ndarray:
    """Differences of the oracle's poses over all parameters, columns of length one."""

    def at(step: np.ndarray) -> np.ndarray:
        moved = replace(arm, links=arm.links + step[:-12].reshape(-1, 5)).within(
            arm.base @ frame(step[-12:-6]), arm.tool @ frame(step[-6:])
        )
        T = moved.poses(q)
        return np.hstack([T[:, :3, 3], T[:, :3, :3].reshape(-1, 9)]) if full_pose else T[:, :3, 3]

    steps = 1e-5 * np.eye(5 * len(arm.links) + 12)
    J = np.array([(at(step) - at(-step)).ravel() for step in steps]).T / 2e-5
    lengths = np.linalg.norm(J, axis=0)
    return J[:, lengths > 1e-8] / lengths[lengths > 1e-8]


def test_parallel_axes_keep_beta_and_give_up_d(tmp_path):
    result = identify(bundle_of(tmp_path, "staubli_tx60", true_cell("staubli_tx60", 6)))
    assert result.status("beta_2") == "identified"
    assert result.status("d_2") == "redundant"
    assert "d_3" in result.reasons["d_2"]
    for other in (1, 3, 4, 5, 6):
        assert result.status(f"beta_{other}") == "redundant"


def test_an_arm_of_documented_near_parallel_axes_is_identified_as_well(tmp_path):
    """A controller's own calibration leaves axes 2 and 3 some mrad from parallel."""
    cell = true_cell("ur10e", 8)
    tilt = np.zeros((6, 5))
    tilt[1, 3:] = (2e-3, -1e-3)
    tilt[2, 3:] = (-1.5e-3, 2e-3)
    nominal = replace(cell.nominal, links=cell.nominal.links + tilt)
    true = replace(cell.true, links=cell.true.links + tilt)
    write_bundle(tmp_path, "ur10e", Cell(nominal, true), rows=80)
    text = (tmp_path / "robot.yaml").read_text()
    lines = iter(np.rad2deg(nominal.links[:, 3:]))
    joints = [
        line if "type:" not in line else _with_tilt(line, *next(lines))
        for line in text.splitlines()
    ]
    (tmp_path / "robot.yaml").write_text("\n".join(joints))
    result = identify(read_bundle(tmp_path))
    assert result.converged
    assert result.fit.position_rms < 60e-6
    assert result.held_out.position_rms < 80e-6


def _with_tilt(line: str, alpha: float, beta: float) -> str:
    head = line[: line.index("alpha_deg")]
    return f"{head}alpha_deg: {alpha:.9f}, beta_deg: {beta:.9f}, limits_deg: [-360, 360]}}"


def test_held_out_rows_never_touch_the_fit(tmp_path):
    bundle = bundle_of(tmp_path, "ur5e", true_cell("ur5e", 7))
    rows = bundle.measurements
    held = rows.held_out
    assert held.sum() == 15
    moved = replace(
        rows,
        position=np.where(held[:, None], rows.position + 0.01, rows.position),
        orientation=np.where(held[:, None], [1.0, 0.0, 0.0, 0.0], rows.orientation),
        joints=np.where(held[:, None], rows.joints + 0.3, rows.joints),
    )
    clean = identify(bundle)
    spoilt = identify(replace(bundle, measurements=moved))
    np.testing.assert_array_equal(spoilt.model.links, clean.model.links)
    np.testing.assert_array_equal(spoilt.base, clean.base)
    np.testing.assert_array_equal(spoilt.tool, clean.tool)
    np.testing.assert_array_equal(spoilt.covariance, clean.covariance)
    assert (spoilt.rank, spoilt.adequacy, spoilt.fit) == (clean.rank, clean.adequacy, clean.fit)
    assert spoilt.held_out.position_rms > 1e-3 > clean.held_out.position_rms


def test_repeats_of_a_pose_are_held_out_together(tmp_path):
    write_bundle(tmp_path, "ur5e", true_cell("ur5e", 7), rows=60)
    lines = (tmp_path / "measurements.csv").read_text().splitlines()
    poses = [f"{line},{row // 3}" for row, line in enumerate(lines[1:])]
    (tmp_path / "measurements.csv").write_text("\n".join([f"{lines[0]},pose", *poses]))
    rows = read_bundle(tmp_path).measurements
    per_pose = rows.held_out.reshape(20, 3)
    assert (per_pose.all(axis=1) | ~per_pose.any(axis=1)).all()
    assert per_pose.all(axis=1).sum() == 5


@pytest.mark.parametrize("full_pose", [True, False], ids=["poses", "positions"])
@pytest.mark.parametrize("robot", ["staubli_tx60", "ur10e", "abb_irb910sc", "kuka_iiwa14"])
def test_all_strategies_reach_the_same_minimum(tmp_path, robot, full_pose):
    bundle = bundle_of(tmp_path, robot, true_cell(robot, 9), full_pose=full_pose)
    results = [identify(bundle, strategy) for strategy in STRATEGIES]
    q = bundle.measurements.joints
    first = forward_kinematics(results[0].model, q)
    for other in results[1:]:
        assert other.converged
        assert other.rank == results[0].rank
        chi_square = results[0].adequacy.reduced_chi_square
        assert other.adequacy.reduced_chi_square == pytest.approx(chi_square, rel=1e-6)
        # A hundredth of the noise of the mean of these rows.
        np.testing.assert_allclose(
            forward_kinematics(other.model, q)[:, :3, 3], first[:, :3, 3], atol=2e-8
        )


@pytest.mark.parametrize("robot", ["staubli_tx60", "abb_irb910sc"])
def test_another_algorithm_finds_no_lower_minimum_and_the_same_robot(tmp_path, robot):
    cell = true_cell(robot, 2)
    bundle = bundle_of(tmp_path, robot, cell)
    result = identify(bundle)
    rows = bundle.measurements.fit_rows
    measured = Rotation.from_quat(rows.orientation[:, [1, 2, 3, 0]])
    n = 5 * len(cell.nominal.links)
    free = result.free
    angle = np.tile([True, False, False, True, True], len(cell.nominal.links))
    prior = np.where(angle, PRIOR_ANGLE, PRIOR_LENGTH)

    def arm_at(x: np.ndarray) -> Arm:
        vector = np.zeros(n + 12)
        vector[free] = x
        links = cell.nominal.links + vector[:n].reshape(-1, 5)
        return replace(cell.nominal, links=links).within(
            result.base @ frame(vector[n : n + 6]), result.tool @ frame(vector[n + 6 :])
        )

    def whitened(x: np.ndarray) -> np.ndarray:
        T = arm_at(x).poses(rows.joints)
        position = (rows.position - T[:, :3, 3]) / position_sigma(rows.position)
        turn = (measured * Rotation.from_matrix(T[:, :3, :3]).inv()).as_rotvec()
        known = free < n
        return np.concatenate([
            position.ravel(),
            turn.ravel() / (SIGMA_MRAD * 1e-3),
            x[known] / prior[free[known]],
        ])

    other = least_squares(
        whitened,
        np.zeros(len(free)),
        jac="3-point",
        method="lm",
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    )
    links = result.model.links.ravel() - cell.nominal.links.ravel()
    ours = np.concatenate([links, np.zeros(12)])[free]
    assert (whitened(ours) ** 2).sum() == pytest.approx(2 * other.cost, rel=1e-7)
    np.testing.assert_allclose(
        arm_at(other.x).poses(rows.joints)[:, :3, 3],
        forward_kinematics(result.model, rows.joints)[:, :3, 3],
        atol=1e-8,
    )


def test_the_covariance_is_the_scatter_of_many_fits():
    done = subprocess.run(
        [sys.executable, "-m", "tests.many_fits"],
        cwd=ROOT,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout)
    errors = np.array(found["errors"])
    assert errors.shape == (200, 4, 3)
    information = np.linalg.inv(found["covariances"])
    squares = np.einsum("fpi,pij,fpj->fp", errors, information, errors)
    # At one pose the mean of 200 chi-squares of 3 spreads by 0.17, the share inside by 1.5 %.
    assert squares.mean(axis=0) == pytest.approx([3.0] * 4, abs=0.6)
    inside = (squares < stats.chi2.ppf(0.95, 3)).mean(axis=0)
    assert inside == pytest.approx([0.95] * 4, abs=0.05)
