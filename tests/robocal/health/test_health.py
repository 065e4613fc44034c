"""Health checks of a robot that an independent program moves about."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from robocal.health.check import FALSE_ALARM, check_health, explain, look_alike
from robocal.health.movements import movements
from robocal.health.poses import discriminating_poses, health_poses
from robocal.health.residual import residual_of
from robocal.health.trend import trend
from robocal.measurements import unmeasured_rows
from robocal.planning.candidates import draw_candidates
from tests.robocal.formats.calibrated_arms import calibrated_arm

NOISE = 3e-5


@pytest.fixture(scope="module")
def arm():
    return calibrated_arm("ur10e")


@pytest.fixture(scope="module")
def q(arm):
    return health_poses(arm.calibrated, 8, seed=1)


def turn_z(angle: float) -> np.ndarray:
    T = np.eye(4)
    T[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return T


def check(arm, q, position, seed=0, warming=None):
    noisy = position + np.random.default_rng(seed).normal(0, NOISE, position.shape)
    rows = replace(unmeasured_rows(q), position=noisy)
    residual = residual_of(arm.calibrated, rows, np.full(len(q), NOISE))
    return check_health(residual, warming), residual


def positions(poses: np.ndarray) -> np.ndarray:
    return poses[:, :3, 3]


def test_a_healthy_robot_alarms_as_seldom_as_stated(arm, q):
    healthy = positions(arm.true.poses(q))
    found = [check(arm, q, healthy, seed)[0] for seed in range(150)]
    assert sum(one.alarm for one in found) <= stats.binom.isf(1e-4, 150, FALSE_ALARM)
    # The statistic as a normal one really is one.
    assert stats.kstest([one.z for one in found], "norm").pvalue > 1e-3


def test_a_base_that_was_bumped_is_named_with_its_shift(arm, q):
    bumped = np.eye(4)
    bumped[:3, 3] = [0.4e-3, -0.3e-3, 0.2e-3]
    found, _ = check(arm, q, positions(bumped @ arm.true.poses(q)))
    first = found.alternatives[0]
    assert (found.alarm, first.movement.name, found.explained) == (True, "base", True)
    assert first.probability > 0.95


def test_a_far_shift_with_a_turn_is_still_explained(arm, q):
    bumped = turn_z(0.02)
    bumped[:3, 3] = [0.05, -0.03, 0.01]
    found, _ = check(arm, q, positions(bumped @ arm.true.poses(q)))
    assert (found.alternatives[0].movement.name, found.explained) == ("base", True)


def test_a_tool_that_slipped_is_named_with_its_shift(arm, q):
    slip = np.array([0.2e-3, 0.3e-3, -0.25e-3])
    moved = arm.true.poses(q) @ np.block([[np.eye(3), slip[:, None]], [0, 0, 0, 1]])
    found, _ = check(arm, q, positions(moved))
    first = found.alternatives[0]
    assert (first.movement.name, found.explained) == ("tool", True)
    assert first.numbers == pytest.approx(slip, abs=5 * NOISE)


@pytest.mark.parametrize(("joint", "jump"), [(2, 5e-4), (3, 5e-4), (4, 2e-3), (5, 8e-3)])
def test_a_joint_zero_that_jumped_is_named_with_its_angle(arm, q, joint, jump):
    off = q.copy()
    off[:, joint - 1] += jump
    found, _ = check(arm, q, positions(arm.true.poses(off)))
    first = found.alternatives[0]
    assert (first.movement.name, found.explained) == (f"joint_{joint}", True)
    assert first.numbers[0] == pytest.approx(jump, abs=5 * first.std[0])
    assert first.probability > 0.9


def test_a_warmer_robot_is_told_from_one_that_was_bumped(arm, q):
    links = arm.true.links.copy()
    links[:, 1:3] *= 1 + 15 * 23e-6
    found, _ = check(arm, q, positions(replace(arm.true, links=links).poses(q)), warming=15.0)
    first = found.alternatives[0]
    assert (first.movement.name, found.explained) == ("temperature", True)
    assert first.numbers[0] == pytest.approx(15 * 23e-6, rel=0.2)


def test_a_turn_of_the_base_about_joint_1_is_what_joint_1_looks_like(arm, q):
    off = q.copy()
    off[:, 0] += 0.5e-3
    found, residual = check(arm, q, positions(arm.true.poses(off)))
    first = found.alternatives[0]
    base = next(one for one in found.alternatives if one.movement.name == "base")
    assert first.movement.name == "joint_1"
    assert look_alike(first.movement, base.movement, residual, first.numbers)
    tool = next(one for one in found.alternatives if one.movement.name == "tool")
    assert not look_alike(first.movement, tool.movement, residual, first.numbers)


def test_two_things_at_once_are_not_called_one(arm, q):
    off = q.copy()
    off[:, 1] += 1e-3
    off[:, 3] -= 2e-3
    found, _ = check(arm, q, positions(arm.true.poses(off)))
    assert found.alarm
    assert not found.explained


def test_the_poses_that_tell_two_explanations_apart_do(arm, q):
    off = q[:4].copy()
    off[:, 2] += 0.5e-3
    found, _ = check(arm, q[:4], positions(arm.true.poses(off)))
    first, second = found.alternatives[:2]
    chosen, difference = discriminating_poses(arm.calibrated, first, second, seed=1)
    assert len(chosen) == 4
    assert (np.diff(difference) <= 0).all()
    assert difference[-1] > NOISE


def test_the_chosen_poses_show_every_joint_better_than_random_ones(arm, q):
    def worst(poses):
        rows = replace(unmeasured_rows(poses), position=positions(arm.true.poses(poses)))
        residual = residual_of(arm.calibrated, rows, np.full(len(poses), NOISE))
        found = explain(residual, movements(6, None))
        # The last joints turn about points near the target, from wherever it is looked at.
        turns = [one for one in found if one.movement.name in {"joint_1", "joint_2", "joint_3"}]
        return max(float(one.std[0]) for one in turns)

    random = draw_candidates(arm.calibrated.robot, 8, np.random.default_rng(3))
    assert worst(q) < worst(random)


def test_a_slow_drift_alarms_in_the_trend_before_any_single_check():
    # One check alarms at z = 3.09, one in a thousand.
    creeping = [0.0] * 5 + [0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8]
    assert trend(creeping[:5]) is None
    assert trend(creeping[:8]).alarm is False
    assert trend(creeping).alarm is True


def test_what_the_model_never_explained_is_no_drift():
    rng = np.random.default_rng(6)
    assert trend(list(2.5 + 0.3 * rng.normal(0, 1, 40))).alarm is False


def test_the_trend_of_a_healthy_robot_seldom_alarms():
    rng = np.random.default_rng(5)
    alarms = sum(trend(list(rng.normal(0, 1, 30))).alarm for _ in range(2000))
    # Beyond three standard deviations to one side.
    assert alarms < stats.binom.isf(1e-4, 2000, 0.00135)
