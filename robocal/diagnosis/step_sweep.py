"""Effects that begin at one row, for all first rows at once by sums back from the last row."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Effect, Instance
from robocal.diagnosis.group import Group, listed
from robocal.diagnosis.linearised import Linearised
from robocal.diagnosis.steps import LINE

STEPS = ("base_step", "tool_step", "encoder_step")


def sweep_steps(
    rows: Circumstances, fit: Linearised, residuals: Float[Array, "scalar residual"]
) -> Iterator[Group]:
    """Every step at every row that may be its first."""
    both = np.concatenate([fit.basis, residuals], axis=1)
    for name in STEPS:
        effect = EFFECTS[name]
        by_joint: dict[int | None, list[Instance]] = {}
        for instance in effect.instances(rows):
            by_joint.setdefault(instance.joint, []).append(instance)
        for instances in by_joint.values():
            yield _group(rows, fit, both, residuals.shape[1], effect, instances)


def _group(
    rows: Circumstances,
    fit: Linearised,
    both: Float[Array, "scalar known_and_residual"],
    n_residuals: int,
    effect: Effect,
    instances: list[Instance],
) -> Group:
    own = instances[0]
    # Before the first row everything has stepped: the columns without their start.
    ever = Instance(own.effect, own.joint, ((LINE, float(rows.lines[0])),), own.coefficients)
    X = fit.columns(effect.moves(rows, ever))
    starts = np.searchsorted(rows.lines, [instance.argument(LINE) for instance in instances])
    edges = np.append(fit.first_scalar[starts], len(fit.row))
    seen = _from_edges(both, X, edges)
    inside, score = seen[:, : both.shape[1] - n_residuals], seen[:, both.shape[1] - n_residuals :]
    return Group(
        own.effect,
        own.joint,
        listed(instances),
        np.tile(own.prior_std, (len(instances), 1)),
        np.full(len(instances), -np.log(len(instances))),
        _from_edges(X, X, edges) - np.swapaxes(inside, 1, 2) @ inside,
        score,
    )


def _from_edges(
    left: Float[Array, "scalar m"], right: Float[Array, "scalar k"], edges: Int[Array, "_"]
) -> Float[Array, "start m k"]:
    """Products over all scalars from each edge on; the last edge is the end."""
    parts = [left[a:b].T @ right[a:b] for a, b in pairwise(edges)]
    return np.asarray(np.cumsum(np.stack(parts)[::-1], axis=0)[::-1])
