"""Distances on rows that chose nothing: those held out, else every row predicted by the others."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.gain import blocks_of
from robocal.diagnosis.joint_fit import JointFit, fit_jointly
from robocal.diagnosis.target_distances import Targets
from robocal.diagnosis.thinning import chosen_rows
from robocal.identification.strategy import Problem


@dataclass(frozen=True)
class _Part:
    """Rows, and the models that were fitted without them."""

    rows: Bool[Array, "row"]
    targets: Targets
    geometric: JointFit
    found: JointFit


@dataclass(frozen=True)
class Unseen:
    """Rows that chose no parameter of the models that predict them."""

    parts: tuple[_Part, ...]

    @property
    def rows(self) -> Bool[Array, "row"]:
        """Which of all rows they are."""
        return np.asarray(np.any([part.rows for part in self.parts], axis=0))

    @property
    def pose(self) -> Int[Array, "some"]:
        """Their poses, in the order of the distances."""
        return np.concatenate([part.targets.measured.pose for part in self.parts])

    def by_geometry(self) -> Float[Array, "some"]:
        """Distances from the predictions of geometry alone [m]."""
        return np.concatenate([part.targets.with_all(part.geometric) for part in self.parts])

    def with_all(self) -> Float[Array, "some"]:
        """Distances with all effects [m]."""
        return np.concatenate([part.targets.with_all(part.found) for part in self.parts])

    def without(self, positions: list[int]) -> Float[Array, "some"]:
        """Distances with some effects taken out, the rest fitted again [m]."""
        return np.concatenate([part.targets.without(part.found, positions) for part in self.parts])


def unseen(
    targets: Targets,
    problem: Problem,
    fitted: Int[Array, "fitted"],
    geometric: JointFit,
    found: JointFit,
) -> Unseen:
    """The rows held out; where none are, the fitted ones by blocked folds.

    Parameters
    ----------
    targets
        All rows.
    problem, fitted
        Of the fit, and the indices of its rows among all.
    geometric, found
        The fit without effects, and with them.
    """
    held_out = targets.measured.held_out & targets.placed
    if held_out.any():
        return Unseen((_Part(held_out, targets.some(held_out), geometric, found),))
    instances = tuple(effect.instance for effect in found.effects)
    fold = blocks_of(targets.measured.pose[fitted])
    parts = []
    for number in np.unique(fold):
        rest = fold != number
        others = replace(problem, rows=problem.rows.choose(rest))
        around = _circumstances(targets, fitted[rest])
        rows = chosen_rows(fitted[~rest], len(targets.measured)) & targets.placed
        parts.append(
            _Part(
                rows,
                targets.some(rows),
                fit_jointly(others, geometric.cell, around, ()),
                fit_jointly(others, found.cell, around, instances, found.effects),
            )
        )
    return Unseen(tuple(parts))


def _circumstances(targets: Targets, rows: Int[Array, "some"]) -> Circumstances:
    return targets.around.rows(chosen_rows(rows, len(targets.measured)))
