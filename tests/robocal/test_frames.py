"""Rigid frames: properties over many random ones, and against scipy's rotations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from robocal.frames import (
    frame_from_xyz_ypr,
    invert,
    nearest_rotation,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_ypr,
    rotation_vector,
    xyz_ypr_from_frame,
)
from tests.elementary_kinematics import frame, random_frame

ANGLES = [
    0.0,
    1e-15,
    1e-12,
    1e-9,
    1e-6,
    1e-3,
    0.1,
    1.0,
    2.0,
    3.0,
    *(np.pi - np.logspace(-15, -2, 8)),
]


def axes(count: int, seed: int = 0) -> np.ndarray:
    """Random directions, and the coordinate axes both ways."""
    random = np.random.default_rng(seed).normal(size=(count, 3))
    random /= np.linalg.norm(random, axis=1, keepdims=True)
    return np.concatenate([random, np.eye(3), -np.eye(3)])


def test_the_six_parameters_mean_translation_yaw_pitch_roll():
    rng = np.random.default_rng(1)
    for _ in range(50):
        six = np.concatenate([rng.uniform(-3, 3, 3), rng.uniform(-7, 7, 3)])
        np.testing.assert_allclose(frame_from_xyz_ypr(six), frame(six), atol=1e-14)
        expected = Rotation.from_euler("ZYX", six[3:]).as_matrix()
        np.testing.assert_allclose(rotation_from_ypr(six[3:]), expected, atol=1e-14)


def test_six_parameters_come_back():
    rng = np.random.default_rng(2)
    for _ in range(200):
        six = np.array([
            *rng.uniform(-3, 3, 3),
            rng.uniform(-3, 3),
            rng.uniform(-1.5, 1.5),
            rng.uniform(-3, 3),
        ])
        np.testing.assert_allclose(xyz_ypr_from_frame(frame(six)), six, atol=1e-12)


@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize(
    "off", [0.0, 1e-16, 1e-13, 1e-12, 3e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-5, 1e-3]
)
def test_the_frame_survives_its_six_parameters_next_to_gimbal_lock(sign, off):
    rng = np.random.default_rng(3)
    for _ in range(20):
        T = frame([0.1, 0.2, 0.3, rng.uniform(-3, 3), sign * (np.pi / 2 - off), rng.uniform(-3, 3)])
        detour = random_frame(rng, 1.0)  # rounds every entry on its own, as a fit's result is
        T = detour @ (np.linalg.inv(detour) @ T)
        # Yaw and roll may differ there, the frame may not: 1e-12 rad is 1 pm at one metre.
        np.testing.assert_allclose(frame(xyz_ypr_from_frame(T)), T, atol=1e-12)


def test_the_inverse_undoes_a_stack_of_frames():
    rng = np.random.default_rng(4)
    T = np.stack([random_frame(rng, 2.0) for _ in range(12)]).reshape(3, 4, 4, 4)
    np.testing.assert_allclose(invert(T) @ T, np.broadcast_to(np.eye(4), T.shape), atol=1e-14)
    np.testing.assert_allclose(invert(T[0, 0]), np.linalg.inv(T[0, 0]), atol=1e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_rotation_comes_back_from_its_quaternion(angle):
    R = Rotation.from_rotvec(axes(30) * angle).as_matrix()
    quaternion = quaternion_from_rotation(R)
    np.testing.assert_allclose(np.linalg.norm(quaternion, axis=1), 1.0, atol=1e-15)
    assert (quaternion[:, 0] >= 0).all()
    np.testing.assert_allclose(rotation_from_quaternion(quaternion), R, atol=1e-14)


@pytest.mark.parametrize("angle", ANGLES)
def test_a_rotation_vector_is_axis_times_angle(angle):
    vectors = axes(30) * angle
    R = Rotation.from_rotvec(vectors).as_matrix()
    found = rotation_vector(R)
    # Next to half a turn the axis may come back reversed; what it stands for may not change.
    np.testing.assert_allclose(Rotation.from_rotvec(found).as_matrix(), R, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), angle, atol=2e-8)
    if angle < 3.0:
        np.testing.assert_allclose(found, vectors, atol=1e-15 + 1e-14 * angle)


def test_quaternions_are_w_first_and_need_not_be_normalised():
    x, y, z, w = Rotation.from_euler("ZYX", [0.3, -0.8, 1.9]).as_quat()
    R = rotation_from_quaternion(np.array([[w, x, y, z], [-3 * w, -3 * x, -3 * y, -3 * z]]))
    expected = Rotation.from_euler("ZYX", [0.3, -0.8, 1.9]).as_matrix()
    np.testing.assert_allclose(R, [expected, expected], atol=1e-15)


def test_the_nearest_rotation_is_never_a_mirror():
    rng = np.random.default_rng(5)
    for _ in range(50):
        M = rng.normal(size=(3, 3))
        R = nearest_rotation(M)
        np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(R) > 0
        others = Rotation.random(50, random_state=rng).as_matrix()
        assert np.linalg.norm(R - M) <= np.linalg.norm(others - M, axis=(1, 2)).min()


def test_a_rotation_is_its_own_nearest_rotation():
    R = Rotation.random(1, random_state=1).as_matrix()[0]
    np.testing.assert_allclose(nearest_rotation(R), R, atol=1e-14)
