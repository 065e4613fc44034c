"""Forward kinematics of every robot against elementary matrices and published poses."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from robocal.kinematics.forward import BLOCK, blocks, forward_kinematics, pose_blocks
from robocal.kinematics.model import KinematicModel, parameter_is_angle, parameter_names
from robocal.robots.library import load_robot
from tests.elementary_kinematics import ROBOT_NAMES, load_arm, random_frame

PUBLISHED = yaml.safe_load(
    (Path(__file__).parents[2] / "reference" / "flange_poses.yaml").read_text()
)


def any_cell(name: str, seed: int):
    """A robot in frames far from trivial, as a model and as the oracle's arm."""
    rng = np.random.default_rng(seed)
    geometry = load_robot(name).geometry
    arm = load_arm(name)
    links = arm.links + rng.normal(scale=0.1, size=arm.links.shape)
    station, mount, flange, base, tool = (random_frame(rng, 2.0) for _ in range(5))
    model = KinematicModel(
        links, geometry.prismatic, station=station, mount=mount, flange=flange
    ).with_frames(base, tool)
    oracle = type(arm)(links, arm.prismatic, arm.limits, base @ mount, tool)
    return model, oracle, oracle.draw(rng, 50, widest=7.0)


@pytest.mark.parametrize("row", PUBLISHED, ids=lambda row: f"{row['robot']}-{row['joints']}")
def test_the_flange_is_where_its_maker_says(row):
    robot = load_robot(row["robot"])
    q = np.array([row["joints"]]) * robot.joint_scale
    position = forward_kinematics(robot.geometry, q)[0, :3, 3] * 1e3
    # The tables are exact in the digits that they print.
    np.testing.assert_allclose(position, row["xyz_mm"], atol=1e-9)


def test_every_robot_has_a_published_pose():
    assert {row["robot"] for row in PUBLISHED} == set(ROBOT_NAMES)


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_a_robot_file_is_the_product_of_its_elementary_matrices(name):
    arm = load_arm(name)
    q = arm.draw(np.random.default_rng(1), 100)
    np.testing.assert_allclose(
        forward_kinematics(load_robot(name).geometry, q), arm.poses(q), atol=1e-14, rtol=0
    )


@pytest.mark.parametrize("name", ROBOT_NAMES)
def test_tilted_links_and_any_frames_are_the_product_of_their_elementary_matrices(name):
    model, oracle, q = any_cell(name, seed=7)
    np.testing.assert_allclose(forward_kinematics(model, q), oracle.poses(q), atol=3e-14, rtol=0)


def test_limits_are_read_in_the_unit_of_each_joint():
    for name in ROBOT_NAMES:
        np.testing.assert_allclose(load_robot(name).limits, load_arm(name).limits, rtol=1e-15)


@pytest.mark.parametrize("count", [1, BLOCK - 1, BLOCK, BLOCK + 1])
def test_a_batch_equals_single_poses_on_both_sides_of_a_block(count):
    model, oracle, _ = any_cell("ur10e", seed=3)
    q = oracle.draw(np.random.default_rng(2), count)
    together = forward_kinematics(model, q)
    for row in {0, count // 2, count - 1}:
        np.testing.assert_array_equal(forward_kinematics(model, q[row : row + 1])[0], together[row])
    np.testing.assert_allclose(together, oracle.poses(q), atol=3e-14, rtol=0)


@pytest.mark.parametrize("count", [0, 1, 1999, 2000, 2001, 4001])
def test_blocks_cover_every_row_once(count):
    rows = [row for block in blocks(count, 2000) for row in range(block.start, block.stop)]
    assert rows == list(range(count))


def test_no_pose_at_all_gives_an_empty_stack():
    model, _, _ = any_cell("ur5", seed=1)
    assert forward_kinematics(model, np.empty((0, 6))).shape == (0, 4, 4)


def test_joints_of_another_robot_are_refused():
    model, _, _ = any_cell("ur5", seed=1)
    with pytest.raises(ValueError, match="6 joints"):
        forward_kinematics(model, np.zeros((3, 4)))


def test_whole_turns_of_a_revolute_joint_change_nothing():
    model, _, q = any_cell("abb_irb120", seed=5)
    turned = q + 2 * np.pi * np.random.default_rng(1).integers(-3, 4, q.shape)
    np.testing.assert_allclose(
        forward_kinematics(model, turned), forward_kinematics(model, q), atol=1e-13, rtol=0
    )


@pytest.mark.parametrize("name", ["staubli_tx60", "abb_irb910sc"])
def test_frames_moved_into_the_constants_leave_the_poses_alone(name):
    model, oracle, q = any_cell(name, seed=11)
    moved = model.with_frames_as_origin()
    assert not moved.base.any()
    assert not moved.tool.any()
    np.testing.assert_allclose(forward_kinematics(moved, q), oracle.poses(q), atol=3e-14, rtol=0)


def test_the_vector_holds_every_parameter_once_under_its_name():
    model, _, _ = any_cell("ur3e", seed=2)
    names = parameter_names(6)
    assert len(names) == len(set(names)) == model.n_parameters == 42
    assert model.vector[names.index("alpha_3")] == model.links[2, 3]
    assert model.vector[names.index("base_z")] == model.base[2]
    assert model.vector[names.index("tool_yaw")] == model.tool[3]
    angles = {names[k] for k in np.flatnonzero(parameter_is_angle(6))}
    assert {name.split("_")[-1] for name in angles if name[:4] in ("base", "tool")} == {
        "yaw", "pitch", "roll",
    }  # fmt: skip
    assert {name.split("_")[0] for name in angles} == {"theta", "alpha", "beta", "base", "tool"}
    again = model.with_vector(model.vector)
    np.testing.assert_array_equal(again.vector, model.vector)


def test_poses_in_pieces_are_the_poses_at_once_and_never_more_than_a_block():
    geometry = load_robot("ur10").geometry
    q = np.random.default_rng(2).uniform(-3.0, 3.0, (2 * BLOCK + 500, 6))
    pieces = (q[:10], q[10:10], q[10 : BLOCK + 700], q[BLOCK + 700 :])
    parts = list(pose_blocks(geometry, iter(pieces)))
    assert max(len(part) for part in parts) <= BLOCK
    np.testing.assert_array_equal(np.concatenate(parts), forward_kinematics(geometry, q))


def test_readings_are_asked_for_one_piece_at_a_time():
    geometry = load_robot("ur10").geometry
    asked = []

    def readings():
        for piece in range(3):
            asked.append(piece)
            yield np.zeros((5, 6))

    poses = pose_blocks(geometry, readings())
    next(poses)
    assert asked == [0]
