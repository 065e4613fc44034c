"""Base, tool and nests of a robot that is known: Gauss-Newton with its effects acting.

Rows that do not belong are left out by the same rule as when the whole geometry is fitted.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.calibrated import CalibratedRobot
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.extended import FittedEffect, moves_of, predict_at
from robocal.diagnosis.joint_fit import effect_columns, whitened_residual
from robocal.diagnosis.linearised import linearise
from robocal.identification.adequacy import Adequacy, judge
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.outliers import RowScores, is_settled, score_rows
from robocal.identification.solve import MAX_REJECTIONS, scaled_inverse

_STEPS = 8
_STANDSTILL = 1e-9
"""[m, rad]"""


@dataclass(frozen=True)
class FramesProblem:
    """Rows of a known robot, and what of its frames they show."""

    start: CellModel
    rows: Observations
    around: Circumstances
    """Of the same rows."""
    free: Int[Array, "free"]
    """Parameters of the frames, the nests and the anchor to fit."""

    def choose(self, used: Bool[Array, "row"]) -> "FramesProblem":
        """The same with the rows where `used` is True."""
        return replace(self, rows=self.rows.choose(used), around=self.around.rows(used))


@dataclass(frozen=True)
class FittedFrames:
    """Fitted base, tool, nests and anchor."""

    cell: CellModel
    covariance: Float[Array, "free free"]
    """Of the free parameters, links and effects taken as exact."""
    chi_square: float
    """Of the positions, where there are any: places are what the model is for."""


@dataclass(frozen=True)
class CleanFrames:
    """A fit, the rows that took part in it, and how far each row is off."""

    frames: FittedFrames
    used: Bool[Array, "row"]
    scores: RowScores


def fit_frames(problem: FramesProblem, effects: tuple[FittedEffect, ...]) -> FittedFrames:
    """Gauss-Newton over the free parameters with the effects acting."""
    cell, rows, free = problem.start, problem.rows, problem.free
    for _ in range(_STEPS):
        fit = linearise(cell, rows, free, np.zeros(len(free)))
        residual = whitened_residual(cell, rows, problem.around, effects)
        step = np.linalg.lstsq(fit.known, residual, rcond=None)[0]
        vector = cell.vector
        vector[free] += step
        cell = cell.with_vector(vector)
        if (np.abs(step) < _STANDSTILL).all():
            break
    covariance = scaled_inverse(fit.known.T @ fit.known)
    judged = rows
    if rows.has_position:
        # An orientation tells the frames, not which effects to carry.
        judged = replace(rows, orientation_weight=np.zeros(len(rows)))
    residual = whitened_residual(cell, judged, problem.around, effects)
    return FittedFrames(cell, covariance, float(residual @ residual))


def moves_with_robot(
    problem: FramesProblem, frames: FittedFrames, effects: tuple[FittedEffect, ...]
) -> Float[Array, "free known"]:
    """How the fitted frames give way to an error of the known robot.

    Parameters
    ----------
    problem
        The rows that took part.
    frames, effects
        Fitted to them, and acting.

    Returns
    -------
    Change of the free parameters by that of the link parameters, then of the coefficients.
    """
    fit = linearise(frames.cell, problem.rows, problem.free, np.zeros(len(problem.free)))
    instances = tuple(fitted.instance for fitted in effects)
    columns, _ = effect_columns(fit, problem.around, instances)
    links = fit.W[: 5 * frames.cell.geometry.n_joints].T
    known = np.concatenate([links, columns], axis=1)
    return np.asarray(-np.linalg.lstsq(fit.known, known, rcond=None)[0])


def fit_without_outliers(problem: FramesProblem, effects: tuple[FittedEffect, ...]) -> CleanFrames:
    """Like `fit_frames`, leaving out rows that do not belong; every row is judged anew."""
    used = np.ones(len(problem.rows), dtype=bool)
    found = _scored(problem, effects, used)
    for _ in range(MAX_REJECTIONS):
        used = ~found.scores.outlying
        if is_settled(used, found.used):
            break
        found = _scored(problem, effects, used)
    return found


def _scored(
    problem: FramesProblem, effects: tuple[FittedEffect, ...], used: Bool[Array, "row"]
) -> CleanFrames:
    frames = fit_frames(problem.choose(used), effects)
    rows = without_effects(frames.cell, problem.rows, problem.around, effects)
    scores = score_rows(frames.cell, rows, problem.free, frames.covariance, used)
    return CleanFrames(frames, used, scores)


def without_effects(
    cell: CellModel,
    rows: Observations,
    around: Circumstances,
    effects: tuple[FittedEffect, ...],
) -> Observations:
    """What would have been measured without the effects: geometry leaves the same residuals."""
    moves = moves_of(around, effects)
    position, axes, distance = rows.position.copy(), rows.axes.copy(), rows.distance.copy()
    for place, index, group in rows.by_place:
        model = cell.at_place(place)
        acting = predict_at(model, group.joints, {k: move[index] for k, move in moves.items()})
        bare = predict_at(model, group.joints, {})
        position[:, index] += bare.p - acting.p
        turned = np.stack([acting.x, acting.y, acting.z], axis=1)
        unturned = np.stack([bare.x, bare.y, bare.z], axis=1)
        axes[:, :, index] = np.einsum("iam,jam,jkm->ikm", unturned, turned, group.axes)
        if cell.anchor is not None:
            anchor = cell.anchor[:, None]
            distance[index] += np.linalg.norm(bare.p - anchor, axis=0)
            distance[index] -= np.linalg.norm(acting.p - anchor, axis=0)
    return replace(rows, position=position, axes=axes, distance=distance)


def frames_adequacy(
    calibrated: CalibratedRobot, problem: FramesProblem, frames: FittedFrames
) -> Adequacy:
    r"""Whether the known robot leaves more in new rows than their noise and its own uncertainty.

    With the columns B of links and effects, times a root of their covariance and projected out of
    the frames, residuals that the frames do not take have covariance :math:`I + B B^T`.

    Parameters
    ----------
    calibrated
        The robot at its new station, with the effects that act.
    problem
        The rows that took part.
    frames
        Fitted to them.
    """
    cell, rows, free = frames.cell, problem.rows, problem.free
    fit = linearise(cell, rows, free, np.zeros(len(free)))
    residual = whitened_residual(cell, rows, problem.around, calibrated.effects)
    instances = tuple(fitted.instance for fitted in calibrated.effects)
    columns, _ = effect_columns(fit, problem.around, instances)
    links, n = 5 * cell.geometry.n_joints, len(calibrated.covariance)
    joint = calibrated.joint_covariance
    known = np.concatenate([np.arange(links), np.arange(n, len(joint))])
    values, vectors = np.linalg.eigh(joint[np.ix_(known, known)])
    B = np.concatenate([fit.W[:links].T, columns], axis=1) @ (vectors * np.sqrt(values.clip(0.0)))
    Q = np.linalg.qr(fit.known)[0]
    B -= Q @ (Q.T @ B)
    score = B.T @ residual
    taken = score @ np.linalg.solve(np.eye(len(score)) + B.T @ B, score)
    chi_square = float(residual @ residual - taken)
    return judge(chi_square, float(rows.n_scalars - len(free)), rows.n_scalars / len(rows))
