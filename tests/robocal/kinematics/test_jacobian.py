"""The analytic Jacobian against differences of the oracle, in every column of every robot."""

import numpy as np
import pytest

from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.jacobian import pose_jacobian
from robocal.kinematics.model import KinematicModel, parameter_names
from robocal.robots.library import load_robot
from tests.elementary_kinematics import ROBOT_NAMES, Arm, frame, load_arm, random_frame

STEP = 4e-3
"""With Richardson's step the difference errs by h^4 f'''''/480 = 5e-13 and by rounding 1e-16 * 2 m
/ h = 1e-13: a thousand times below the tolerance; [m or rad]"""
TOLERANCE = 1e-8


class Cell:
    """A robot between random constant frames, posed by the oracle from a parameter vector."""

    def __init__(self, name: str, seed: int) -> None:
        rng = np.random.default_rng(seed)
        arm = load_arm(name)
        self.station, self.mount, self.flange = (random_frame(rng, 1.0) for _ in range(3))
        self.model = KinematicModel(
            links=arm.links + rng.normal(scale=0.05, size=arm.links.shape),
            prismatic=load_robot(name).geometry.prismatic,
            base=np.array([*rng.uniform(-2, 2, 3), *rng.uniform(-3, 3, 3)]),
            tool=np.array([*rng.uniform(-0.3, 0.3, 3), *rng.uniform(-3, 3, 3)]),
            station=self.station,
            mount=self.mount,
            flange=self.flange,
        )
        self.q = arm.draw(rng, 9)
        self.limits = arm.limits

    def poses(self, vector: np.ndarray, q: np.ndarray) -> np.ndarray:
        links = vector[:-12].reshape(-1, 5)
        base = self.station @ frame(vector[-12:-6]) @ self.mount
        tool = self.flange @ frame(vector[-6:])
        return Arm(links, self.model.prismatic, self.limits, base, tool).poses(q)


def richardson(poses_at) -> np.ndarray:
    """Derivative at 0 of a stack of poses along one direction."""
    coarse, fine = (
        (poses_at(step) - poses_at(-step)) / (2 * step) for step in (STEP, STEP / 2)
    )  # fmt: skip
    return (4 * fine - coarse) / 3


def as_twist(T: np.ndarray, dT: np.ndarray) -> np.ndarray:
    """Rows of position and rotation vector of a derivative, (6, pose)."""
    W = dT[:, :3, :3] @ np.swapaxes(T[:, :3, :3], 1, 2)
    np.testing.assert_allclose(W, -np.swapaxes(W, 1, 2), atol=1e-9)
    return np.concatenate([dT[:, :3, 3].T, [W[:, 2, 1], W[:, 0, 2], W[:, 1, 0]]])


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_every_column_is_the_difference_of_the_poses(name, seed):
    cell = Cell(name, seed)
    vector = cell.model.vector
    T = cell.poses(vector, cell.q)
    target, J = pose_jacobian(cell.model, cell.q)
    np.testing.assert_allclose(target.p.T, T[:, :3, 3], atol=1e-13)
    for index, parameter in enumerate(parameter_names(cell.model.n_joints)):
        unit = np.eye(len(vector))[index]
        dT = richardson(lambda step, unit=unit: cell.poses(vector + step * unit, cell.q))
        np.testing.assert_allclose(
            J[index], as_twist(T, dT), atol=TOLERANCE, rtol=0, err_msg=parameter
        )


@pytest.mark.parametrize("name", ["ur10e", "abb_irb910sc"])
def test_theta_or_d_is_the_derivative_over_the_reading_of_its_joint(name):
    cell = Cell(name, 3)
    vector = cell.model.vector
    T = cell.poses(vector, cell.q)
    _, J = pose_jacobian(cell.model, cell.q)
    for joint, slides in enumerate(cell.model.prismatic):
        columns = J[5 * joint + (1 if slides else 0)]
        unit = np.eye(cell.model.n_joints)[joint]
        dT = richardson(lambda step, unit=unit: cell.poses(vector, cell.q + step * unit))
        np.testing.assert_allclose(columns, as_twist(T, dT), atol=TOLERANCE, rtol=0)


@pytest.mark.parametrize("count", [2000, 2001])
def test_many_poses_equal_single_ones(count):
    cell = Cell("staubli_tx60", 4)
    q = np.resize(cell.q, (count, 6)) + np.linspace(0, 1, count)[:, None]
    _, J = pose_jacobian(cell.model, q)
    for row in (0, 1999, count - 1):
        np.testing.assert_array_equal(
            pose_jacobian(cell.model, q[row : row + 1])[1][..., 0], J[..., row]
        )


def test_a_robot_with_all_axes_parallel_has_a_jacobian_too():
    links = np.zeros((3, 5))
    links[:, 2] = (0.3, 0.2, 0.1)
    arm = KinematicModel(links, np.zeros(3, dtype=bool))
    q = np.random.default_rng(0).normal(size=(5, 3))
    _, J = pose_jacobian(arm, q)
    step = 1e-6
    for index in range(arm.n_parameters):
        moved = np.zeros(arm.n_parameters)
        moved[index] = step
        there = [
            forward_kinematics(arm.with_vector(arm.vector + sign * moved), q)[:, :3, 3]
            for sign in (1.0, -1.0)
        ]
        difference = (there[0] - there[1]) / (2 * step)
        assert np.abs(J[index, :3].T - difference).max() < 1e-8
