"""model.yaml written and read back is the same robot, to 1e-12 m."""

from dataclasses import replace

import numpy as np
import pytest

from robocal.calibrated import CalibratedRobot, Provenance
from robocal.diagnosis.effect import Coefficient, Instance
from robocal.diagnosis.extended import FittedEffect
from robocal.formats.model_yaml import read_model, write_model
from robocal.kinematics.forward import forward_kinematics
from robocal.measurements import MeasurementSet
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


def with_effects() -> CalibratedRobot:
    """Two effects whose coefficients go with each other and with the geometry."""
    robot, _ = calibrated("ur5", 0.4)
    gain = Instance("encoder_gain", 2, (), (Coefficient("gain", 1.0),))
    wave = tuple(Coefficient(f"{name}_rad", 1.0) for name in ("cosine", "sine"))
    gear = Instance("gear_harmonic", 3, (("order", 7.0),), wave)
    n, k = robot.model.n_parameters, 3
    root = np.random.default_rng(5).normal(size=(n + k, n + k)) * 1e-5
    root[n:] *= 3.0
    joint = root @ root.T
    effects = tuple(
        FittedEffect(instance, values, joint[n:, n:][part, part])
        for instance, values, part in (
            (gain, np.array([2e-4]), slice(0, 1)),
            (gear, np.array([1e-4, -3e-4]), slice(1, 3)),
        )
    )
    return replace(
        robot, covariance=joint[:n, :n], effects=effects, coefficient_covariance=joint[n:]
    )


def test_a_model_read_back_knows_how_its_effects_go_with_the_geometry(tmp_path):
    written = with_effects()
    # What is not identified stands at its nominal value and has no covariance to write.
    written.covariance[3], written.covariance[:, 3] = 0.0, 0.0
    written.coefficient_covariance[:, 3] = 0.0
    write_model(tmp_path / "model.yaml", written)
    read = read_model(tmp_path / "model.yaml")
    np.testing.assert_allclose(read.joint_covariance, written.joint_covariance, rtol=1e-11)


def test_the_tools_spread_with_effects_is_that_of_all_that_was_fitted():
    """Against 600 draws of geometry and coefficients together."""
    robot = with_effects()
    q = load_arm("ur5").draw(np.random.default_rng(3), 3)
    nothing = np.full(3, np.nan)
    rows = MeasurementSet(
        lines=np.arange(3),
        joints=q,
        position=np.zeros((3, 3)),
        orientation=np.full((3, 4), np.nan),
        distance=nothing,
        pose=np.arange(3),
        target=("",) * 3,
        held_out=np.zeros(3, dtype=bool),
        time=nothing,
        temperature=nothing,
        payload=nothing,
        speed=nothing,
        settle=nothing,
        approach=np.full((3, 6), np.nan),
        commanded=np.full((3, 6), np.nan),
    )
    n, joint = robot.model.n_parameters, robot.joint_covariance
    draws = np.random.default_rng(4).multivariate_normal(np.zeros(n + 3), joint * 1e-4, 600)
    gain, gear = robot.effects

    def places(step):
        moved = replace(
            robot,
            model=robot.model.with_vector(robot.model.vector + step[:n]),
            effects=(
                replace(gain, values=gain.values + step[n : n + 1]),
                replace(gear, values=gear.values + step[n + 1 :]),
            ),
        )
        return moved.poses_of(rows)[:, :3, 3]

    drawn = np.array([places(step) for step in draws])
    for row, covariance in enumerate(robot.position_covariance_of(rows)):
        stated = np.diag(covariance) * 1e-4
        np.testing.assert_allclose(np.diag(np.cov(drawn[:, row].T)), stated, rtol=0.25)
        apart = np.diag(robot.tool_position_covariance(q)[row]) * 1e-4
        assert (stated > 1.2 * apart).any()
