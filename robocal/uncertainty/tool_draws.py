"""Tool positions of many draws of the robot's parameters, through the full forward kinematics."""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.kinematics.forward import forward_kinematics
from robocal.kinematics.model import KinematicModel
from robocal.uncertainty.many_cells import many_targets
from robocal.uncertainty.sources import Source


def draw_parameters(
    sources: tuple[Source, ...], rng: np.random.Generator, count: int
) -> Float[Array, "parameter draw"]:
    """Moves of the parameters: normal, and t where a source's variance comes from few readings.

    References
    ----------
    .. [1] JCGM 101:2008, 6.4.8 (multivariate normal), 6.4.9 (t).
    """
    certain = [source.covariance for source in sources if np.isinf(source.nu)]
    moves = np.zeros((len(sources[0].covariance), count))
    if certain:
        moves += normal_draws(np.sum(certain, axis=0), rng, count)
    for source in sources:
        if np.isfinite(source.nu):
            spread = np.sqrt(source.nu / rng.chisquare(source.nu, count))
            moves += spread * normal_draws(source.covariance, rng, count)
    return moves


def normal_draws(
    covariance: Float[Array, "parameter parameter"], rng: np.random.Generator, count: int
) -> Float[Array, "parameter draw"]:
    """Draws with the given covariance, through its scaled eigenvectors (rank may be low)."""
    std = np.sqrt(np.diag(covariance))
    known = std > 0
    scale = std[known]
    values, vectors = np.linalg.eigh(covariance[np.ix_(known, known)] / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.clip(values, 0.0, None))
    result = np.zeros((len(std), count))
    result[known] = root @ rng.normal(size=(len(scale), count))
    return result


def tool_moves(
    model: KinematicModel, moves: Float[Array, "parameter draw"], q: Float[Array, "pose joint"]
) -> Float[Array, "pose 3 draw"]:
    """How far each draw puts the target from where the estimate puts it [m].

    Parameters
    ----------
    model
        Estimate.
    moves
        Change of every parameter of the robot [m, rad].
    q
        Joint readings [rad or m].
    """
    vectors = model.vector[:, None] + moves[: model.n_parameters]
    estimate = forward_kinematics(model, q)[:, :3, 3]
    away = np.empty((len(q), 3, moves.shape[1]))
    # One pose at a time: 10,000 draws of one pose are a block that stays in the cache.
    for pose in range(len(q)):
        target = many_targets(model, vectors, q[pose : pose + 1]).target
        away[pose] = target.p - estimate[pose][:, None]
    return away
