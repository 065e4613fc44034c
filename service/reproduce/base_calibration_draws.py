"""Both methods on many noise draws of document 001's experiments."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.base_calibration.arm import Arm
from robocal.base_calibration.projection import project
from robocal.base_calibration.solution import solve
from robocal.base_calibration.stage import Readings, Stage
from robocal.base_calibration.touches import Touches
from robocal.frames import xyz_ypr_from_frame
from robocal.kinematics.jacobian import pose_jacobian
from robocal.progress import counted
from service.reproduce.base_calibration_paper import Experiment, Printed, arm, scara

PERFECT_STAGE = Stage(
    sigma_slide=1e-6,
    sigma_rod=1e-6,
    sigma_angle=1e-6,
    level_in_master=True,
    level_in_slave=True,
    sigma_level=1e-6,
    prior_std=np.zeros(8),
)
"""The paper leaves the sensors' errors out; figures far below its joint noise stand for none."""
_FLOOR = 1e-6
"""Tip uncertainty that remains where all noisy joints are zero [m]"""
_ROUNDING = 1e-4
"""Last digit of table 2 [rad]"""
_MASTER_PLACES = ((-0.3, 0.1), (0.5, -0.1), (0.1, 0.6), (0.1, -0.6))
"""Rod cup at the master's four touches: metres beyond the guide across it, and y in the master's
base. Near joint 1's zero eq. (12) leaves little noise; far apart across the guide they level it."""
_MASTER_SLIDE = 0.3
"""Where the slide is then, from P2 on [m]"""
_SLAVE_TURNS = (-0.7, -0.2, 0.2, 0.7)
"""Joint 1 at the slave's four touches [rad]"""


@dataclass(frozen=True)
class Layout:
    """Touches to make: joints of each robot, and what the perfect sensors read."""

    master: Float[Array, "touch 6"]
    slave: Float[Array, "touch 4"]
    on_rod: Bool[Array, "both"]
    readings: Readings


def paper_layout(experiment: Experiment) -> Layout:
    """P1, P2, R1, R2 as the paper has them; readings from the model."""
    on_rod = np.array([True, False, True, True])
    at_rest = _places(experiment, experiment.master_joints, experiment.slave_joints)
    slides = np.array([0.0, 0.0, experiment.travel, experiment.travel])
    readings = _readings(at_rest, slides, on_rod, experiment)
    return Layout(experiment.master_joints, experiment.slave_joints, on_rod, readings)


def wide_layout(experiment: Experiment, wrist: Float[Array, "4 3"], elbow: float) -> Layout:
    """Four touches each of the rod cup.

    Parameters
    ----------
    wrist
        Joints 4 to 6 from which the master goes to each touch: as in the paper, or general [rad].
    elbow
        Joint 2 of the slave; away from zero its needle's yaw is no polar angle [rad].
    """
    master = arm()
    p2 = master.needle_poses(experiment.master_joints)[1, :3, 3]
    cups = np.array([[p2[0] + across, y, p2[2]] for across, y in _MASTER_PLACES])
    towards = np.arctan2(cups[:, 1], cups[:, 0])
    bent = np.tile([-np.pi / 2, 0.0], (4, 1))
    joints = master.joints_at(cups, np.column_stack([towards, bent, wrist]))
    q_slave = np.column_stack([_SLAVE_TURNS, np.full(4, elbow), np.zeros((4, 2))])
    on_rod = np.ones(8, dtype=bool)
    slides = np.array([_MASTER_SLIDE] * 4 + [experiment.travel] * 4)
    places = _places(experiment, joints, q_slave)
    readings = _readings(places, slides, on_rod, experiment)
    return Layout(joints, q_slave, on_rod, readings)


def _places(
    experiment: Experiment, master: Float[Array, "touch 6"], slave: Float[Array, "touch2 4"]
) -> Float[Array, "both 3"]:
    """Needle tips in the master's base."""
    T = experiment.transform
    tips = scara().needle_poses(slave)[:, :3, 3] @ T[:3, :3].T + T[:3, 3]
    return np.concatenate([arm().needle_poses(master)[:, :3, 3], tips])


def _readings(
    places: Float[Array, "both 3"],
    slides: Float[Array, "both"],
    on_rod: Bool[Array, "both"],
    experiment: Experiment,
) -> Readings:
    """What perfect sensors read: the guide runs along -y from P2, the rod turns towards +x."""
    p2 = arm().needle_poses(experiment.master_joints)[1, :3, 3]
    pivot = p2 + slides[:, None] * np.array([0.0, -1.0, 0.0])
    rod = places - pivot
    angle = np.arctan2(rod[:, 0], rod[:, 1])
    length = np.linalg.norm(rod, axis=1)
    return Readings(slides, np.where(on_rod, angle, 0.0), np.where(on_rod, length, 0.0))


def noisy(q: Float[Array, "touch joint"], amplitude: float, rng: np.random.Generator) -> Array:
    """Eq. (12): uniform noise in proportion to each angle."""
    return np.asarray(q + amplitude * 1e-3 * q * (rng.random(q.shape) - 0.5))


def touches_of(layout: Layout, amplitude: float, master: Array, slave: Array) -> Touches:
    """The touches as the service would see them: joints as read, weights by their noise."""
    n_master, n = len(master), len(master) + len(slave)
    covariance = np.zeros((3 * n, 3 * n))
    first = 0
    for robot, q in ((arm(), master), (scara(), slave)):
        size = 3 * len(q)
        covariance[first : first + size, first : first + size] = _by_noise(robot, q, amplitude)
        first += size
    return Touches(
        lines=np.arange(1, n + 1),
        by_slave=np.arange(n) >= n_master,
        on_rod=layout.on_rod,
        placement=np.zeros(n, dtype=int),
        readings=layout.readings,
        needle_poses=np.concatenate([arm().needle_poses(master), scara().needle_poses(slave)]),
        tip_covariance=covariance,
    )


def _by_noise(robot: Arm, q: Array, amplitude: float) -> Float[Array, "scalar scalar"]:
    """Tip covariance [m2] of joints with the standard deviation of eq. (12), 1 / sqrt 12 of it."""
    _, J = pose_jacobian(robot.model, q)
    rows = [5 * joint + int(slides) for joint, slides in enumerate(robot.model.prismatic)]
    by_joint = J[rows, :3] * (amplitude * 1e-3 * np.abs(q.T) / np.sqrt(12.0))[:, None, :]
    covariance = np.eye(3 * len(q)) * _FLOOR**2
    for touch in range(len(q)):
        block = slice(3 * touch, 3 * touch + 3)
        covariance[block, block] += by_joint[:, :, touch].T @ by_joint[:, :, touch]
    return covariance


@dataclass(frozen=True)
class Errors:
    """e_rot [rad] and e_tran [m] of one method, one a draw."""

    rot: Float[Array, "draw"]
    tran: Float[Array, "draw"]


def errors_of(T: Float[Array, "4 4"], experiment: Experiment) -> tuple[float, float]:
    """Section 4.3's two figures: norms of the angles' and of the coordinates' errors."""
    away = xyz_ypr_from_frame(T) - xyz_ypr_from_frame(experiment.transform)
    away[3:] = (away[3:] + np.pi) % (2 * np.pi) - np.pi
    return float(np.linalg.norm(away[3:])), float(np.linalg.norm(away[:3]))


def draw_projection(experiment: Experiment, amplitude: float, draws: int, seed: int) -> Errors:
    """The projection method on the paper's four touches."""
    layout, rng = paper_layout(experiment), np.random.default_rng(seed)
    found = []
    for _ in counted("document 001, projection", range(draws), draws):
        q = (noisy(part, amplitude, rng) for part in (layout.master, layout.slave))
        answer = project(touches_of(layout, amplitude, *q), PERFECT_STAGE)
        if answer.transform is None:
            raise AssertionError(answer.refusal)
        found.append(errors_of(answer.transform, experiment))
    return Errors(*np.array(found).T)


def draw_within_rounding(experiment: Experiment, printed: Printed, draws: int, seed: int) -> Errors:
    """The projection method on all joints that table 2 would print alike: +-0.5e-4 rad of each."""
    layout, rng = paper_layout(experiment), np.random.default_rng(seed)
    found = []
    for _ in counted("document 001, rounding", range(draws), draws):
        q = (
            # A joint at zero has no noise, so its print is exact.
            read + _ROUNDING * (rng.random(read.shape) - 0.5) * (at_rest != 0.0)
            for read, at_rest in ((printed.master, layout.master), (printed.slave, layout.slave))
        )
        answer = project(touches_of(layout, printed.amplitude, *q), PERFECT_STAGE)
        if answer.transform is None:
            raise AssertionError(answer.refusal)
        found.append(errors_of(answer.transform, experiment))
    return Errors(*np.array(found).T)


def draw_registration(
    experiment: Experiment, layout: Layout, amplitude: float, draws: int, seed: int
) -> Errors:
    """The weighted least squares on any layout."""
    rng, found = np.random.default_rng(seed), []
    for _ in counted("document 001, least squares", range(draws), draws):
        q = (noisy(part, amplitude, rng) for part in (layout.master, layout.slave))
        solution = solve(touches_of(layout, amplitude, *q), PERFECT_STAGE)
        found.append(errors_of(solution.state.slave, experiment))
    return Errors(*np.array(found).T)
