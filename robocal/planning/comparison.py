"""What each way of choosing poses is worth: calibrations of robots with known errors, seed by seed.

For every seed a robot with random errors of its parameters is drawn, and candidates and test poses
with it. Each choice measures its poses with the instrument's noise, several times over, the robot
is calibrated, and the tool's true error at the test poses counts, beside the uncertainty predicted.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel, parameter_is_angle
from robocal.planning.candidates import draw_candidates
from robocal.planning.cell import Cell
from robocal.planning.chosen_set import Selection
from robocal.planning.pose_rows import PoseRows, pose_rows
from robocal.planning.prediction import predicted_radius
from robocal.planning.selectors import SELECTORS, merit
from robocal.robots.robot import Robot

TEST_POSES = 200
_LENGTH_ERROR = 0.5e-3
"""One standard deviation of the drawn errors [m]"""
_ANGLE_ERROR = 1e-3
"""[rad]"""
_CALIBRATIONS = 5
"""Noisy campaigns of every chosen set"""
_STEPS = 5
"""Gauss-Newton steps: from errors of a milliradian the fourth is below a nanometre"""


@dataclass(frozen=True)
class Choice:
    """A way of choosing poses."""

    selector: str
    merit: str


@dataclass(frozen=True)
class Worth:
    """What one choice gave with one seed."""

    choice: Choice
    seed: int
    predicted: float
    """Mean radius over the test poses, `prediction.COVERAGE` [m]."""
    error: float
    """Root mean square distance of the calibrated from the true robot's target [m]."""


def compare(
    robot: Robot, cell: Cell, choices: tuple[Choice, ...], candidates: int, count: int, seed: int
) -> list[Worth]:
    """Worth of every choice with one seed, all from the same candidates and the same robot.

    Parameters
    ----------
    robot, cell
        Positions are measured, whatever else the cell's instrument sees.
    choices
        Ways to compare.
    candidates, count
        Poses to choose from, poses chosen.
    seed
        Of everything drawn.
    """
    rng = np.random.default_rng(seed)
    q = draw_candidates(robot, candidates, rng, cell)
    test = draw_candidates(robot, TEST_POSES, rng, cell.for_test_poses())
    rows = pose_rows(robot, cell, q)
    test_rows = rows.position_rows(test)
    truth = _with_errors(rows, rng)
    result = []
    for choice in choices:
        selection = Selection(rows.J, count, merit(choice.merit, test_rows), seed)
        chosen = SELECTORS[choice.selector](selection)
        predicted = float(predicted_radius(rows.J, chosen, test_rows).mean())
        errors = [
            _error_after(rows, truth, cell, q[chosen], test, np.random.default_rng([seed, draw]))
            for draw in range(_CALIBRATIONS)
        ]
        result.append(Worth(choice, seed, predicted, float(np.sqrt(np.mean(np.square(errors))))))
    return result


def _with_errors(rows: PoseRows, rng: np.random.Generator) -> KinematicModel:
    """The nominal robot with errors of the parameters that can be told apart."""
    angle = parameter_is_angle(rows.model.n_joints)[rows.parameters]
    vector = rows.model.vector.copy()
    vector[rows.parameters] += rng.normal(size=len(angle)) * np.where(
        angle, _ANGLE_ERROR, _LENGTH_ERROR
    )
    return rows.model.with_vector(vector)


def _error_after(
    rows: PoseRows,
    truth: KinematicModel,
    cell: Cell,
    q: Float[Array, "pose joint"],
    test: Float[Array, "test joint"],
    rng: np.random.Generator,
) -> float:
    """Root mean square error of the target at the test poses after one campaign [m]."""
    position = forward_kinematics(truth, q)[:, :3, 3]
    station = np.zeros(3) if cell.station is None else np.array(cell.station.position)
    std = cell.noise.position_std(position - station)
    measured = position + std[:, None] * rng.normal(size=position.shape)
    calibrated = _calibrate(rows.model, rows.parameters, q, measured, std)
    away = forward_kinematics(calibrated, test) - forward_kinematics(truth, test)
    return float(np.sqrt((away[:, :3, 3] ** 2).sum(axis=1).mean()))


def _calibrate(
    model: KinematicModel,
    parameters: Int[Array, "parameter"],
    q: Float[Array, "pose joint"],
    measured: Float[Array, "pose 3"],
    std: Float[Array, "pose"],
) -> KinematicModel:
    """Weighted least squares over the parameters, by Gauss-Newton."""
    for _ in range(_STEPS):
        target, J = pose_jacobian(model, q)
        A = (J[parameters, :3] / std).reshape(len(parameters), -1)
        r = ((measured.T - target.p) / std).ravel()
        scale = np.linalg.norm(A, axis=1)
        vector = model.vector.copy()
        vector[parameters] += np.linalg.lstsq((A.T / scale), r, rcond=None)[0] / scale
        model = model.with_vector(vector)
    return model
