"""Distances on rows that chose nothing: those held out, else every row predicted by the others."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.find import MANY_ROWS, Steps
from robocal.diagnosis.gain import blocks_of
from robocal.diagnosis.joint_fit import JointFit, fit_jointly
from robocal.diagnosis.select import select_effects
from robocal.diagnosis.target_distances import Targets
from robocal.diagnosis.thinning import chosen_rows
from robocal.identification.strategy import Problem

_EVERY = 5
"""With many rows every fifth pose is predicted by the others; [1]"""


@dataclass(frozen=True)
class _Part:
    """Rows, and the models that were fitted without them."""

    rows: Bool[Array, "row"]
    targets: Targets
    geometric: JointFit
    found: JointFit

    def without(self, gone: set[Instance], stay: set[Instance]) -> Float[Array, "row"]:
        """Distances with some effects taken out, the rest fitted again [m]."""
        # Chosen from other rows, an effect may have another order or begin at another line.
        everything = [*gone, *stay]
        positions = []
        for position, fitted in enumerate(self.found.effects):
            alike = [one for one in everything if _name(one) == _name(fitted.instance)]
            if alike and min(alike, key=lambda one: _apart(one, fitted.instance)) in gone:
                positions.append(position)
        return self.targets.without(self.found, positions)


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

    def without(self, gone: set[Instance], stay: set[Instance]) -> Float[Array, "some"]:
        """Distances with some effects taken out, the rest, which stay, fitted again [m]."""
        return np.concatenate([part.without(gone, stay) for part in self.parts])


def unseen(targets: Targets, problem: Problem, steps: Steps) -> Unseen:
    """The rows held out; where none are, folds of the fitted ones, each with its own choice.

    Parameters
    ----------
    targets
        All rows.
    problem
        Of the fit.
    steps
        The fits without effects and with them, and what they were chosen by.
    """
    held_out = targets.measured.held_out & targets.placed
    if held_out.any():
        return Unseen((_Part(held_out, targets.some(held_out), steps.geometric, steps.found),))
    pose = targets.measured.pose[steps.fitted]
    if len(pose) > MANY_ROWS:
        # One fold tells enough, and choosing takes long.
        fold = np.unique(pose, return_inverse=True)[1] % _EVERY
        return Unseen((_part(targets, problem, steps, fold == 0),))
    fold = blocks_of(pose)
    parts = (_part(targets, problem, steps, fold == number) for number in np.unique(fold))
    return Unseen(tuple(parts))


def _part(targets: Targets, problem: Problem, steps: Steps, fold: Bool[Array, "fitted"]) -> _Part:
    """A fold, and the models that the other rows choose."""
    others = replace(problem, rows=problem.rows.choose(~fold))
    around = _circumstances(targets, steps.fitted[~fold])
    rows = chosen_rows(steps.fitted[fold], len(targets.measured)) & targets.placed
    geometric = fit_jointly(others, steps.geometric.cell, around, ())
    found = geometric
    if steps.limits is not None and steps.found.effects:
        found = select_effects(others, geometric.cell, around, steps.limits)
    return _Part(rows, targets.some(rows), geometric, found)


def _name(instance: Instance) -> tuple[str, int | None]:
    return instance.effect, instance.joint


def _apart(one: Instance, other: Instance) -> tuple[int, float]:
    """How unlike two forms of one effect and joint are: in what they depend on, then how far."""
    first, second = dict(one.arguments), dict(other.arguments)
    lacking = len(first.keys() ^ second.keys())
    return lacking, sum(abs(first[name] - second[name]) for name in first.keys() & second.keys())


def _circumstances(targets: Targets, rows: Int[Array, "some"]) -> Circumstances:
    return targets.around.rows(chosen_rows(rows, len(targets.measured)))
