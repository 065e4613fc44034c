"""DETMAX as document 002 describes it: add the best, delete the least, shake when it stops.

The set of m poses grows by the best candidate and loses the least useful one until both are the
same. Then b of its poses are exchanged at random for candidates (c of them once the best set has
stood for a rounds), and it starts over; it ends when the best set has stood for d rounds.

References
----------
.. [1] X. Wen et al., Chinese Journal of Scientific Instrument, 2022, section 2.3, steps 1 to 10.
.. [2] T. J. Mitchell, "An algorithm for the construction of D-optimal experimental designs",
   Technometrics 16(2), 1974.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Int
from numpy import ndarray as Array

from robocal.planning import greedy_exchange
from robocal.planning.chosen_set import SAME, ChosenSet, Selection, improve, outside
from robocal.progress import tell


@dataclass(frozen=True)
class DetmaxSettings:
    """Parameters of the document, with its values (section 4.2)."""

    a: int = 40
    """Rounds without a better set after which fewer poses are exchanged."""
    b: int = 2
    """Poses exchanged at random before that."""
    c: int = 1
    """Poses exchanged at random after that."""
    d: int = 80
    """Rounds without a better set after which the search ends."""


DOCUMENT_SETTINGS = DetmaxSettings()


def select(selection: Selection) -> Int[Array, "chosen"]:
    """Candidates of the best set found, in rising order.

    The document's search; and, as from its one random start it can end below a plain exchange
    (seen for O2 and O3, by 3 %), the better of its set and the exchange's, which then has had its
    adding and deleting too.
    """
    found = search_from_random(selection)
    current = selection.merit(selection.J)
    current.restart(tuple(found.tolist()))
    value = current.value()
    current.restart(tuple(greedy_exchange.select(selection).tolist()))
    improve(current)
    return np.array(sorted(current.chosen)) if current.value() > value else found


def search_from_random(
    selection: Selection, settings: DetmaxSettings = DOCUMENT_SETTINGS
) -> Int[Array, "chosen"]:
    """Steps 1 to 10 of the document and nothing else; candidates in rising order."""
    rng = np.random.default_rng(selection.seed)
    start = rng.choice(len(selection.J), size=selection.count, replace=False)
    current = selection.merit(selection.J)
    current.restart(tuple(start.tolist()))
    return _search(selection, current, settings, rng)


def _search(
    selection: Selection, current: ChosenSet, settings: DetmaxSettings, rng: np.random.Generator
) -> Int[Array, "chosen"]:
    """Steps 3 to 10, from the present set."""
    best: tuple[int, ...] = ()
    best_value = -np.inf
    stood = 0
    while True:
        tell("rounds without a better set", stood, settings.d)
        improve(current)
        value = current.value()
        if value > best_value + SAME * abs(best_value) or not best:
            best, best_value, stood = current.chosen, value, 0
        else:
            stood += 1
            if stood == settings.d:
                return np.array(sorted(best))
        exchanged = settings.c if stood >= settings.a else settings.b
        _shake(current, len(selection.J), exchanged, rng)


def _shake(current: ChosenSet, n_candidates: int, count: int, rng: np.random.Generator) -> None:
    """Exchange some poses at random."""
    free = outside(n_candidates, current.chosen)
    count = min(count, len(free), len(current.chosen))
    leaving = rng.choice(np.array(current.chosen), size=count, replace=False)
    coming = rng.choice(free, size=count, replace=False)
    current.change(tuple(leaving.tolist()), tuple(coming.tolist()))
