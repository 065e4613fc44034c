"""A set of poses under search: what every selector needs to know of it, whatever the index."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

RIDGE = 1e-8
"""Information of a set without poses, on columns whose mean square over the candidates is one: lets
a search pass through sets that are too small, and is too little to move a choice; [1]"""

SAME = 1e-10
"""Figures of merit within this share of each other count as equal; [1]"""


@runtime_checkable
class ChosenSet(Protocol):
    """Poses chosen so far, kept ready to be changed by a few.

    Ties go to the candidate with the lowest number, so that a search depends on its seed alone.
    """

    @property
    def chosen(self) -> tuple[int, ...]:
        """Candidates in the set, in the order in which they came."""
        ...

    def restart(self, chosen: tuple[int, ...]) -> None:
        """Replace the set."""
        ...

    def change(self, leaving: tuple[int, ...], coming: tuple[int, ...]) -> None:
        """Take some candidates out and put others in."""
        ...

    def best_addition(self) -> int:
        """The candidate outside that improves the set most."""
        ...

    def best_removal_after(self, added: int) -> int:
        """The candidate whose loss costs least once `added` has come in; may be `added` itself."""
        ...

    def best_addition_without(self, old: int) -> int:
        """The candidate that improves the set most once `old` has gone; may be `old` itself."""
        ...

    def value(self) -> float:
        """Figure of merit, larger is better; comparable between sets of one size."""
        ...


Rows = Float[Array, "pose row parameter"]


@dataclass(frozen=True)
class Selection:
    """What a selector is asked.

    Parameters
    ----------
    J
        Whitened rows of every candidate, columns scaled.
    count
        Number of poses wanted.
    merit
        Makes the set that knows the figure of merit.
    seed
        Of every random choice.
    """

    J: Rows
    count: int
    merit: Callable[[Rows], ChosenSet]
    seed: int


Selector = Callable[[Selection], Int[Array, "chosen"]]


def information(J: Rows, chosen: tuple[int, ...]) -> Float[Array, "parameter parameter"]:
    """Sum of the chosen poses' information, with the ridge."""
    rows = J[list(chosen)].reshape(-1, J.shape[2])
    return np.asarray(rows.T @ rows + RIDGE * np.eye(J.shape[2]))


def outside(n_candidates: int, chosen: tuple[int, ...]) -> Int[Array, "candidate"]:
    """Candidates that are not in the set."""
    free = np.ones(n_candidates, dtype=bool)
    free[list(chosen)] = False
    return np.flatnonzero(free)


def improve(current: ChosenSet) -> None:
    """Add the best and delete the least useful until both are the same pose."""
    value = current.value()
    while True:
        added = current.best_addition()
        removed = current.best_removal_after(added)
        if removed == added:
            return
        current.change((removed,), (added,))
        # Two poses that are worth the same would be exchanged for ever.
        before, value = value, current.value()
        if value <= before + SAME * abs(before):
            return
