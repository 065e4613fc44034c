"""The touch that would make the base-to-base transform surest, by predicted uncertainty."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.base_calibration.arm import Arm
from robocal.base_calibration.equations import free_unknowns, touch_rows
from robocal.base_calibration.solution import Solution
from robocal.base_calibration.stage import Readings, Stage
from robocal.base_calibration.touches import Touches

_WEAK = 1.0
"""Standard uncertainty that stands for an open direction in the prediction [m, rad]"""
_STEP_ANGLE = np.deg2rad(15.0)
_SLIDES, _LENGTHS = 5, 3


@dataclass(frozen=True)
class Travel:
    """What the stage can be set to; None where the touches made so far must say."""

    slide: tuple[float, float] | None = None
    """[m]"""
    angle: tuple[float, float] = (-np.pi / 2, np.pi / 2)
    """[rad]"""
    length: tuple[float, float] | None = None
    """[m]"""


@dataclass(frozen=True)
class Pair:
    """Both robots, each with the joints of its own touches [rad or m]."""

    master: Arm
    slave: Arm
    master_joints: Float[Array, "_ joint"]
    slave_joints: Float[Array, "_ _"]


@dataclass(frozen=True)
class Proposal:
    """One touch to make."""

    by_slave: bool
    on_rod: bool
    slide: float
    """[m]"""
    angle: float
    """[rad]"""
    length: float
    """[m]"""
    placement: int
    place: Float[Array, "3"]
    """Where the cup then is, in the touching robot's base [m]."""
    before: float
    after: float
    """Position uncertainty of the slave over its reach, root mean square, now and then [m]."""


def best_next_touch(
    solution: Solution, touches: Touches, stage: Stage, travel: Travel, pair: Pair | None = None
) -> Proposal | None:
    """The reachable touch with the least predicted uncertainty.

    Parameters
    ----------
    solution, touches, stage
        What is known so far.
    travel
        Ranges of the stage.
    pair
        Both robots; without them a place counts as reachable no farther out than the places
        touched so far.

    Returns
    -------
    proposal
        None where no candidate is in reach.
    """
    candidates = candidate_touches(solution, touches, travel)
    reachable = _in_reach(candidates, touches, pair)
    if not reachable.any():
        return None
    candidates = candidates.only(reachable)
    placement = touches.n_placements - 1
    prediction = predicted_uncertainty(solution, touches, stage, candidates)
    # While a direction is open it alone makes the uncertainty, and hides how well a touch tells it.
    score = prediction.volume if solution.null.shape[1] else prediction.after
    best = int(np.argmin(score))
    readings = candidates.readings
    return Proposal(
        bool(candidates.by_slave[best]),
        bool(candidates.on_rod[best]),
        float(readings.slide[best]),
        float(readings.angle[best]),
        float(readings.length[best]),
        placement,
        candidates.tips[best],
        prediction.before,
        float(prediction.after[best]),
    )


def candidate_touches(solution: Solution, touches: Touches, travel: Travel) -> Touches:
    """A grid over the stage's travel, for both robots and cups, where the stage stands now."""
    rows = []
    angles = np.arange(travel.angle[0], travel.angle[1] + 1e-9, _STEP_ANGLE)
    for by_slave in (False, True):
        own = touches.by_slave == by_slave
        slides = _grid(travel.slide, touches.readings.slide[own], _SLIDES)
        lengths = _grid(travel.length, touches.readings.length[touches.on_rod], _LENGTHS)
        for slide in slides:
            rows.append((by_slave, False, slide, 0.0, 0.0))
            rows += [
                (by_slave, True, slide, angle, length) for length in lengths for angle in angles
            ]
    slave, rod, slide, angle, length = (np.array(column) for column in zip(*rows, strict=True))
    n = len(rows)
    blank = Touches(
        lines=np.arange(n),
        by_slave=slave,
        on_rod=rod,
        placement=np.full(n, touches.n_placements - 1),
        readings=Readings(slide, angle, length),
        needle_poses=np.tile(np.eye(4), (n, 1, 1)),
        tip_covariance=np.eye(3 * n),
    )
    # With the tips at the origin of their bases the misclosure is the way to the cup.
    way = -touch_rows(solution.state, blank).misclosure
    blank.needle_poses[:, :3, 3] = np.where(slave[:, None], way @ solution.state.slave[:3, :3], way)
    return blank


def _grid(
    given: tuple[float, float] | None, seen: Float[Array, "touch"], count: int
) -> Float[Array, "value"]:
    low, high = (seen.min(), seen.max()) if given is None and len(seen) else (given or (0.0, 0.0))
    return np.linspace(low, high, count) if high > low else np.array([low])


def _in_reach(candidates: Touches, touches: Touches, pair: Pair | None) -> Bool[Array, "touch"]:
    result = np.zeros(len(candidates), dtype=bool)
    for by_slave in (False, True):
        own = candidates.by_slave == by_slave
        if pair is None:
            made = np.linalg.norm(touches.tips[touches.by_slave == by_slave], axis=1)
            result[own] = np.linalg.norm(candidates.tips[own], axis=1) <= made.max()
        elif by_slave:
            result[own] = pair.slave.reaches(candidates.tips[own], pair.slave_joints[0])
        else:
            result[own] = pair.master.reaches(candidates.tips[own], pair.master_joints[0])
    return result


@dataclass(frozen=True)
class Prediction:
    """How sure the slave's place would be after each candidate."""

    before: float
    """Position uncertainty over the slave's reach now, root mean square [m]."""
    after: Float[Array, "touch"]
    """The same after the touch [m]."""
    volume: Float[Array, "touch"]
    """Logarithm of the determinant of the slave's covariance after the touch."""


def predicted_uncertainty(
    solution: Solution, touches: Touches, stage: Stage, candidates: Touches
) -> Prediction:
    """What each candidate would do to the slave's covariance, by the linearised equations."""
    state = solution.state
    free = free_unknowns(state, stage)
    J = solution.equations.J[:, free]
    known = np.linalg.inv(J.T @ J + np.eye(J.shape[1]) / _WEAK**2)
    rows = touch_rows(state, candidates)
    by = rows.J[:, :, free]
    sigma = np.array([stage.sigma_slide, stage.sigma_angle, stage.sigma_rod])
    spread = rows.by_reading * sigma
    noise = np.einsum("tij,tkj->tik", spread, spread)
    for by_slave in (False, True):
        made = np.repeat(touches.by_slave == by_slave, 3)
        typical = float(np.diag(touches.tip_covariance)[made].mean())
        noise[candidates.by_slave == by_slave] += np.eye(3) * typical
    seen = np.einsum("tij,jk->tik", by, known)
    gain = np.linalg.inv(noise + np.einsum("tij,tkj->tik", seen, by))
    reach = float(np.linalg.norm(touches.tips[touches.by_slave], axis=1).max())
    # A place on a sphere of that radius is moved by two thirds of each turn's square.
    weight = np.array([1.0, 1.0, 1.0, *(2.0 / 3.0 * reach**2 * np.ones(3))])
    first = int(np.cumsum(free)[state.slave_columns.start]) - 1
    slave = slice(first, first + 6)
    fallen = np.einsum("tis,tij,tjr->tsr", seen[:, :, slave], gain, seen[:, :, slave])
    now = known[slave, slave]
    left = now - fallen
    after = np.clip(np.einsum("tss->ts", left), 0.0, None) @ weight
    return Prediction(
        float(np.sqrt(np.diag(now) @ weight)),
        np.asarray(np.sqrt(after)),
        np.asarray(np.linalg.slogdet(left)[1]),
    )
