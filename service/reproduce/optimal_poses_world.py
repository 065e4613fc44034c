"""The simulated experiment of document 002: a TX60 that is not nominal, a tracker, a calibration.

The document measures poses of the flange in the robot base frame, which is known, and fits 24 link
parameters without priors. So does this.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.instrument import InstrumentNoise
from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import KinematicModel, parameter_names
from robocal.planning.candidates import draw_candidates
from robocal.planning.cell import Box, Cell
from robocal.planning.document_002 import PARAMETERS
from robocal.robots.library import load_robot
from robocal.uncertainty.many_fits import Estimator, ManyFits, Readings, fit_many
from robocal.uncertainty.simulated_readings import turn_axes
from service.reproduce.optimal_poses_paper import DISTANCE_BEFORE

NOISE = InstrumentNoise(15e-6, 6e-6, 5e-5)
"""AT960: 0.015 mm + 6 ppm; its probe's orientation, which the document does not state: 0.05 mrad"""
TRACKER = np.array([2.5, 0.0, 0.3])
"""Where the tracker stands in the robot base; the document does not say [m]"""
CELL = Cell((0.0, 0.0, 0.0), Box((-0.2, -0.6, -0.2), (0.7, 0.6, 0.6)), floor=-0.375)
"""900 x 1200 x 800 mm about (250, 0, 200)"""
TESTS = 50
_LENGTH_ERROR, _ANGLE_ERROR = 2e-4, 5e-4
"""Shape of the true errors before they are scaled to the document's 0.459 mm [m, rad]"""
FREE = np.array([parameter_names(6).index(name) for name in PARAMETERS])


@dataclass(frozen=True)
class World:
    """The true robot, and how it departs from any link parameters.

    Parameters
    ----------
    true
        Link parameters.
    wave
        Amplitude of a transmission error of two cycles a turn in every joint, which no link
        parameter can follow [rad].
    phase
        Of each joint's wave [rad].
    repeatability
        Of the robot, per axis [m].
    """

    true: KinematicModel
    wave: float
    phase: Float[Array, "joint"]
    repeatability: float

    def poses(self, q: Float[Array, "pose joint"]) -> Float[Array, "pose 4 4"]:
        """Where the flange really is."""
        return forward_kinematics(self.true, q + self.wave * np.sin(2.0 * q + self.phase))

    def read(self, q: Float[Array, "pose joint"], rng: np.random.Generator, times: int) -> Readings:
        """Noisy readings of every pose, so many times."""
        T = self.poses(q)
        shape = (3, times, len(q))
        position = np.repeat(T[:, :3, 3].T[:, None], times, axis=1)
        std = NOISE.position_std(T[:, :3, 3] - TRACKER)
        moved = rng.normal(size=shape) * np.hypot(std, self.repeatability)
        axes = np.repeat(np.moveaxis(T[:, :3, :3], 0, 2)[:, :, None], times, axis=2)
        turns = rng.normal(size=shape) * NOISE.orientation_std()
        return Readings(position + moved, turn_axes(axes, turns), np.zeros(shape[1:]))


@dataclass(frozen=True)
class Poses:
    """Candidates to calibrate at, and points to test at [rad]."""

    candidates: Float[Array, "pose joint"]
    tests: Float[Array, "pose joint"]


def draw_poses(seed: int, candidates: int) -> Poses:
    """Random reachable poses in the document's workspace."""
    robot = load_robot("staubli_tx60")
    q = draw_candidates(robot, candidates + TESTS, np.random.default_rng([seed, 1]), CELL)
    return Poses(q[:candidates], q[candidates:])


def draw_world(poses: Poses, seed: int, wave: float, repeatability: float) -> World:
    """A robot whose test points are off by the document's 0.459 mm on average."""
    rng = np.random.default_rng([seed, 2])
    nominal = load_robot("staubli_tx60").geometry
    is_length = np.array([name.startswith(("d_", "a_")) for name in PARAMETERS])
    error = rng.normal(size=len(FREE)) * np.where(is_length, _LENGTH_ERROR, _ANGLE_ERROR)
    phase = rng.uniform(-np.pi, np.pi, 6)
    size = 1.0
    for _ in range(5):  # the distance is all but proportional to the errors
        world = World(_moved(nominal, size * error), wave, phase, repeatability)
        away = world.poses(poses.tests) - forward_kinematics(nominal, poses.tests)
        distance = np.linalg.norm(away[:, :3, 3], axis=1).mean()
        size *= DISTANCE_BEFORE * 1e-3 / distance
    return world


def _moved(nominal: KinematicModel, error: Float[Array, "free"]) -> KinematicModel:
    vector = nominal.vector
    vector[FREE] += error
    return nominal.with_vector(vector)


def estimator(q: Float[Array, "pose joint"]) -> Estimator:
    """The document's fit at these poses: 24 parameters, no prior, nominal start."""
    nominal = load_robot("staubli_tx60").geometry
    n = len(q)
    position = forward_kinematics(nominal, q)[:, :3, 3]
    rows = Observations(
        joints=q,
        position=position.T,
        axes=np.zeros((3, 3, n)),
        distance=np.zeros(n),
        place=np.full(n, -1),
        position_weight=1.0 / NOISE.position_std(position - TRACKER),
        orientation_weight=np.full(n, 1.0 / NOISE.orientation_std()),
        distance_weight=np.zeros(n),
    )
    return Estimator(CellModel(nominal), rows, FREE, np.zeros(len(FREE)))


def calibrate(
    world: World, q: Float[Array, "pose joint"], rng: np.random.Generator, times: int = 1
) -> tuple[ManyFits, Readings]:
    """Measure the poses so many times and fit each time on its own."""
    readings = world.read(q, rng, times)
    own = estimator(q)
    start = np.repeat(own.cell.vector[FREE][:, None], times, axis=1)
    return fit_many(own, readings, start), readings


def mean_distance(
    vector: Float[Array, "parameter"], q: Float[Array, "pose joint"], readings: Readings
) -> float:
    """Mean distance of the first reading of every pose from what the parameters predict [m]."""
    model = load_robot("staubli_tx60").geometry.with_vector(vector)
    away = readings.position[:, 0].T - forward_kinematics(model, q)[:, :3, 3]
    return float(np.linalg.norm(away, axis=1).mean())
