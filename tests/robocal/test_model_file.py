"""model.yaml written and read back is the same robot, to 1e-12 m."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.formats.model_yaml import read_model, write_model
from robocal.kinematics.forward import forward_kinematics
from robocal.robots.library import load_robot
from tests.elementary_kinematics import Arm, frame, load_arm, random_frame


def calibrated(name: str, tool_pitch: float) -> tuple[CalibratedRobot, Arm]:
    """A robot with a mount and a flange of its own, off nominal, and the oracle's arm."""
    rng = np.random.default_rng(1)
    nominal = load_robot(name)
    mount, flange, base = (random_frame(rng, 0.5) for _ in range(3))
    tool = frame([0.1, -0.2, 0.3, 0.7, tool_pitch, -1.1])
    arm = load_arm(name)
    links = arm.links + rng.normal(scale=1e-3, size=arm.links.shape)
    geometry = replace(nominal.geometry, mount=mount, flange=flange)
    model = replace(geometry, links=links, station=base, flange=flange @ tool)
    root = rng.normal(size=(model.n_parameters, model.n_parameters)) * 1e-5
    covariance = root @ root.T
    covariance[3], covariance[:, 3] = 0.0, 0.0
    robot = CalibratedRobot(
        robot=replace(nominal, geometry=geometry),
        model=model,
        covariance=covariance,
        gravity=np.array([0.0, 0.6, -0.8]),
        provenance=Provenance("0" * 64, "1.0", "2026-01-01T00:00:00+00:00", "cross"),
    )
    return robot, Arm(links, arm.prismatic, arm.limits, base @ mount, flange @ tool)


@pytest.mark.parametrize("tool_pitch", [0.4, np.pi / 2, np.pi / 2 - 1e-10])
@pytest.mark.parametrize("name", ["ur10e", "abb_irb910sc"])
def test_a_model_read_back_predicts_the_same(tmp_path, name, tool_pitch):
    written, arm = calibrated(name, tool_pitch)
    write_model(tmp_path / "model.yaml", written)
    read = read_model(tmp_path / "model.yaml")
    q = arm.draw(np.random.default_rng(2), 1000)
    np.testing.assert_allclose(read.tool_poses(q), arm.poses(q), atol=1e-12)
    np.testing.assert_allclose(read.tool_poses(q), written.tool_poses(q), atol=1e-12)
    np.testing.assert_allclose(
        forward_kinematics(read.robot.geometry, q),
        forward_kinematics(written.robot.geometry, q),
        atol=1e-12,
    )


def test_a_model_read_back_is_as_sure_and_remembers_where_it_is_from(tmp_path):
    written, _ = calibrated("staubli_tx60", 0.4)
    write_model(tmp_path / "model.yaml", written)
    read = read_model(tmp_path / "model.yaml")
    np.testing.assert_allclose(read.covariance, written.covariance, rtol=1e-12, atol=0)
    np.testing.assert_allclose(read.gravity, written.gravity)
    np.testing.assert_allclose(read.robot.limits, written.robot.limits, rtol=1e-14)
    assert read.provenance == written.provenance
    assert read.robot.name == written.robot.name


def test_the_tools_spread_is_that_of_its_parameters():
    """Against 600 draws: a variance is then known to 6 %."""
    robot, _ = calibrated("ur5", 0.4)
    q = load_arm("ur5").draw(np.random.default_rng(3), 3)
    n = robot.model.n_parameters
    draws = np.random.default_rng(4).multivariate_normal(np.zeros(n), robot.covariance * 1e-4, 600)
    places = np.array([
        forward_kinematics(robot.model.with_vector(robot.model.vector + step), q)[:, :3, 3]
        for step in draws
    ])
    for row, covariance in enumerate(robot.tool_position_covariance(q)):
        drawn = np.cov(places[:, row].T)
        np.testing.assert_allclose(np.diag(drawn), np.diag(covariance) * 1e-4, rtol=0.25)
