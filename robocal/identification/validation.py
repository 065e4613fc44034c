"""Prediction error on rows left out in turn, at random and in blocks.

Random folds say how well the model interpolates among poses like the measured ones; blocked folds
(runs of rows in file order, which is order in time and mostly in space) how well it goes beyond
them. All repeats of a pose stay together.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int
from numpy import ndarray as Array

from robocal.formats.bundle import Bundle
from robocal.identification.identify import summarise
from robocal.identification.prepared import Prepared, prepare
from robocal.identification.priors import prior_std
from robocal.identification.result import Identification, ResidualSummary
from robocal.identification.solve import problem_of
from robocal.identification.strategies import STRATEGIES
from robocal.progress import counted

FOLDS = 5
_SEED = 1


@dataclass(frozen=True)
class Folds:
    """Residuals of every fit row, predicted by a fit that did not see it."""

    count: int
    random: ResidualSummary
    blocked: ResidualSummary


def cross_validate(bundle: Bundle, result: Identification, count: int = FOLDS) -> Folds | None:
    """Refit without each fold in turn; None where the rows are too few to spare any.

    Parameters
    ----------
    bundle, result
        What was identified from what; rows that it rejected take no part.
    count
        Number of folds.
    """
    ready = prepare(bundle, result.choices)
    rejected = {row.line for row in result.rejected}
    spare = ~ready.rows.held_out & ~np.isin(ready.rows.lines, list(rejected))
    poses = ready.rows.pose[spare]
    _, first, number = np.unique(poses, return_index=True, return_inverse=True)
    rank_in_file = np.argsort(np.argsort(first))
    in_order = rank_in_file[number] * count // len(first)
    shuffled = np.random.default_rng(_SEED).permutation(len(first))
    at_random = shuffled[number] * count // len(first)
    measured = ready.observe(bundle, spare).n_scalars
    if measured * (count - 1) < count * (result.rank + 1):
        return None
    return Folds(
        count,
        _left_out(bundle, ready, result, spare, at_random, count),
        _left_out(bundle, ready, result, spare, in_order, count),
    )


def _left_out(
    bundle: Bundle,
    ready: Prepared,
    result: Identification,
    spare: Array,
    fold: Int[Array, "row"],
    count: int,
) -> ResidualSummary:
    """Pooled residuals over all folds."""
    rows = ready.observe(bundle, spare)
    how = STRATEGIES[result.strategy]
    std = prior_std(result.cell, ready.choices)
    parts = []
    for number in counted("fits without a fold", range(count), count):
        out = fold == number
        if not out.any():
            continue
        problem = problem_of(result.cell, rows.choose(~out), result.free, std, ready.start)
        parts.append(summarise(how(problem).cell, rows.choose(out)))
    return pooled(parts)


def pooled(parts: list[ResidualSummary]) -> ResidualSummary:
    """One summary of several disjoint sets of rows."""
    n = np.array([part.rows for part in parts])
    share = n / n.sum()
    rms = np.array([part.position_rms for part in parts])
    mean = np.array([part.position_mean for part in parts])
    angles = [part.orientation_rms for part in parts if part.orientation_rms is not None]
    angle = float(np.sqrt(np.mean(np.square(angles)))) if angles else None
    return ResidualSummary(
        rows=int(n.sum()),
        position_rms=float(np.sqrt(share @ rms**2)),
        position_mean=float(share @ mean),
        position_max=max(part.position_max for part in parts),
        orientation_rms=angle,
    )
