"""Monte Carlo of the tool's position: against the law of propagation, a loop, and a paper."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy import stats

from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import KinematicModel, parameter_is_angle, parameter_names
from robocal.robots.library import load_robot
from robocal.uncertainty.tool_draws import normal_draws, tool_moves
from robocal.uncertainty.tool_pose import coverage_radius
from tests.elementary_kinematics import Arm, frame, load_arm, random_frame

TABLE = yaml.safe_load(
    (Path(__file__).parents[2] / "reference" / "wen_2022_table_3.yaml").read_text()
)


def cell_model(robot: str) -> KinematicModel:
    """A robot between random frames that stand in its constants."""
    rng = np.random.default_rng(1)
    geometry = load_robot(robot).geometry
    return replace(
        geometry,
        station=random_frame(rng, 2.0),
        mount=random_frame(rng, 0.3),
        flange=random_frame(rng, 0.2),
    )


def some_covariance(model: KinematicModel) -> np.ndarray:
    """Correlated, of low rank, 10 um and 20 urad in size, all parameters involved."""
    n = model.n_parameters
    mixing = np.random.default_rng(2).normal(size=(n, n - 8)) / np.sqrt(n)
    scale = np.where(parameter_is_angle(model.n_joints), 2e-5, 1e-5)
    root = scale[:, None] * mixing
    return root @ root.T


def drawn_moves(
    model: KinematicModel, covariance: np.ndarray, q: np.ndarray, draws: int = 10_000, seed: int = 1
) -> np.ndarray:
    """How far draws of the parameters move the target."""
    moves = normal_draws(covariance, np.random.default_rng(seed), draws)
    return tool_moves(model, moves, q)


def oracle_position(model: KinematicModel, vector: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Position of one draw at one pose, by elementary matrices."""
    base = model.station @ frame(vector[-12:-6]) @ model.mount
    arm = Arm(
        vector[:-12].reshape(-1, 5), model.prismatic, np.zeros((model.n_joints, 2)), base,
        model.flange @ frame(vector[-6:]),
    )  # fmt: skip
    return arm.poses(q[None])[0, :3, 3]


@pytest.mark.parametrize("robot", ["ur10e", "abb_irb910sc"])
def test_the_spread_is_that_of_the_law_of_propagation(robot):
    """A well-conditioned case: 10,000 draws know a standard deviation to 0.7 %."""
    model = cell_model(robot)
    covariance = some_covariance(model)
    q = load_arm(robot).draw(np.random.default_rng(3), 6)
    drawn = drawn_moves(model, covariance, q, seed=5)
    for row, joints in enumerate(q):
        steps = 1e-6 * np.eye(model.n_parameters)
        J = np.array([
            oracle_position(model, model.vector + step, joints)
            - oracle_position(model, model.vector - step, joints)
            for step in steps
        ]).T / 2e-6  # fmt: skip
        law = J @ covariance @ J.T
        np.testing.assert_allclose(drawn[row].std(axis=1), np.sqrt(np.diag(law)), rtol=0.03)
        assert np.abs(drawn[row].mean(axis=1)).max() < 5 * np.sqrt(law.max() / 10_000)
        ball = np.random.default_rng(1).multivariate_normal(np.zeros(3), law, 100_000)
        radius = np.quantile(np.linalg.norm(ball, axis=1), 0.95)
        found = np.quantile(np.linalg.norm(drawn[row], axis=0), 0.95)
        assert found == pytest.approx(radius, rel=0.03)
        stated = coverage_radius(law[None], np.array([np.inf]))[0]
        assert stated == pytest.approx(radius, rel=0.02)


def test_one_sure_draw_is_one_forward_kinematics():
    """Without any uncertainty every draw is the estimate."""
    model = cell_model("staubli_tx60")
    nothing = np.zeros((model.n_parameters, model.n_parameters))
    q = load_arm("staubli_tx60").draw(np.random.default_rng(3), 3)
    assert np.abs(drawn_moves(model, nothing, q, draws=10)).max() < 1e-14


def test_the_same_seed_draws_the_same():
    model = cell_model("ur5e")
    q = np.zeros((1, 6))
    one, two, other = (
        drawn_moves(model, some_covariance(model), q, 500, seed) for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(one, two)
    assert one[0, 0, 0] != other[0, 0, 0]


@pytest.mark.parametrize(("column", "kind"), [(0, "optimal"), (1, "random")])
def test_the_papers_robot_spreads_as_the_paper_says(column, kind):
    """Ranges over 10,000 draws are 7.7 standard deviations wide, give or take one."""
    model = load_robot("staubli_tx60").geometry
    names = parameter_names(6)
    unit = np.where(parameter_is_angle(6), np.pi / 180, 1e-3)
    std = np.array([TABLE["parameters"].get(name, (0.0, 0.0))[column] for name in names]) * unit
    drawn = drawn_moves(model, np.diag(std**2), np.zeros((1, 6)))[0].std(axis=1)
    published = TABLE["at_zero"][kind]
    np.testing.assert_allclose(
        forward_kinematics(model, np.zeros((1, 6)))[0, :3, 3], [0, 0.02, 0.67], atol=1e-15
    )
    for axis, (low, high) in enumerate(published["range_mm"]):
        width = (high - low) / 1e3 / drawn[axis]
        assert width == pytest.approx(_expected_range(10_000), abs=1.2)
    assert drawn[2] * 1e3 == pytest.approx(published["u_mm"], rel=0.15)


def _expected_range(n: int) -> float:
    """Mean range of n normal draws, twice the mean of the largest (Blom's approximation)."""
    return 2 * stats.norm.ppf((n - 0.375) / (n + 0.25))
