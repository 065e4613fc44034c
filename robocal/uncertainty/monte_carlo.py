"""Tool position of many draws of the robot's parameters, at given joint readings."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.frames import rotation_from_ypr
from robocal.kinematics.forward import Columns, chain, forward_kinematics
from robocal.kinematics.model import KinematicModel

DRAWS = 10_000
COVERAGE = 0.95


@dataclass(frozen=True)
class ToolPositionDraws:
    """What the draws say about the tool's position at each pose."""

    mean_shift: Float[Array, "pose 3"]
    """Mean of the draws less the position of the estimate [m]."""
    std: Float[Array, "pose 3"]
    """Standard uncertainty of each coordinate [m]."""
    radius: Float[Array, "pose"]
    """Distance from the estimate that holds `COVERAGE` of the draws [m]."""


def draw_tool_positions(
    model: KinematicModel,
    covariance: Float[Array, "parameter parameter"],
    q: Float[Array, "pose joint"],
    draws: int = DRAWS,
    seed: int = 1,
) -> ToolPositionDraws:
    """Propagate the parameters' distribution through the full forward kinematics.

    Parameters
    ----------
    model
        Estimate; `base` and `tool` are zero (`KinematicModel.with_frames_as_origin`).
    covariance
        Of all parameters, zero for those that are not uncertain [m, rad].
    q
        Joint readings [rad or m].
    draws, seed
        Number of draws of a multivariate normal distribution, and the seed of its generator.

    References
    ----------
    .. [1] JCGM 101:2008, 6.4.8 (multivariate Gaussian distribution).
    """
    vectors = model.vector[:, None] + _normal_draws(covariance, draws, seed)
    n = 5 * model.n_joints
    links = vectors[:n].reshape(model.n_joints, 5, draws)
    start = _base_draws(model, vectors[n : n + 6])
    tool = model.flange[:3, :3] @ vectors[n + 6 : n + 9] + model.flange[:3, 3:]
    mean_shift, std, radius = np.empty((len(q), 3)), np.empty((len(q), 3)), np.empty(len(q))
    estimate = forward_kinematics(model, q)[:, :3, 3]
    for pose, reading in enumerate(q):
        last, _ = chain(start, links, model.prismatic, reading)
        p = last.p + last.x * tool[0] + last.y * tool[1] + last.z * tool[2]
        away = p - estimate[pose][:, None]
        mean_shift[pose] = away.mean(axis=1)
        std[pose] = away.std(axis=1, ddof=1)
        radius[pose] = np.quantile(np.linalg.norm(away, axis=0), COVERAGE)
    return ToolPositionDraws(mean_shift, std, radius)


def _normal_draws(
    covariance: Float[Array, "parameter parameter"], draws: int, seed: int
) -> Float[Array, "parameter draw"]:
    """Draws with the given covariance, through its scaled eigenvectors (rank may be low)."""
    std = np.sqrt(np.diag(covariance))
    known = std > 0
    scale = std[known]
    values, vectors = np.linalg.eigh(covariance[np.ix_(known, known)] / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.clip(values, 0.0, None))
    result = np.zeros((len(std), draws))
    result[known] = root @ np.random.default_rng(seed).normal(size=(len(scale), draws))
    return result


def _base_draws(model: KinematicModel, base: Float[Array, "6 draw"]) -> Columns:
    """Axes and origin of the first link's frame for every draw of the base frame."""
    R = np.stack([rotation_from_ypr(ypr) for ypr in base[3:].T], axis=2)
    R = np.einsum("ij,jkm,kl->ilm", model.station[:3, :3], R, model.mount[:3, :3])
    p = model.station[:3, :3] @ base[:3] + model.station[:3, 3:]
    mount = model.mount[:3, 3]
    if mount.any():
        turned = np.einsum("ilm,lk->ikm", R, model.mount[:3, :3].T)
        p = p + np.einsum("ikm,k->im", turned, mount)
    return Columns(R[:, 0], R[:, 1], R[:, 2], p)
