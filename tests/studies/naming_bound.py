r"""How often can a hidden effect be named right at all?

`python -m tests.studies.naming_bound --seed 1 --kind one` prints what share the best of all namers
names right, of the campaigns with one effect that an alarm detects: the best of all tests, and one
that wants a clear name too (`robocal/diagnosis/alarm.py`). By the theorem of Bayes the best namer
weighs effects by how often they are drawn and names the joint and effect that

.. math:: p(name \mid y) \propto \sum_{k\,called\,so} \exp(d_k^T W y - \tfrac12 d_k^T W d_k)

makes most probable; nothing does better on average. It is told what nobody knows, see
`detection_bound.py`, and even the form of the effect: with `--kind other_forms` it knows how the
emulated world's springs harden. The effects are a sample. Where the hidden one is among them the
share is too large, where it is not it is too small.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from robocal.diagnosis.alarm import CLEARNESS
from tests.blind.trials import ROBOTS, workers
from tests.studies.detection_bound import ALARMS, DRAWS
from tests.studies.drawn_effects import Place, likelihoods, place

WEIGHTS = {"the best test": 0.0, "an alarm that wants a clear name": CLEARNESS}
"""Weight of the best name's share in what raises each; [1]"""


def named(at: Place, seed: int, clearness: float = 0.0) -> tuple[float, float]:
    """Share of what is detected that is named right, with the hidden effect known and without."""
    rng = np.random.default_rng(seed)
    # Whether the temperature is read is seen, and tells some effects apart.
    right, found = np.zeros(2), np.zeros(2)
    for probed in np.unique(at.probed):
        here = rng.permutation(np.flatnonzero(at.probed == probed))
        hidden, others = here[: len(here) // 2], here[len(here) // 2 :]
        drawn = rng.choice(hidden, size=round(DRAWS * len(here) / len(at.name)))
        noise = rng.normal(size=(len(drawn), at.shift.shape[1]))
        readings = (at.shift[drawn] + noise).T
        alarm = rng.normal(size=(at.shift.shape[1], DRAWS))
        for which, known in enumerate((here, others)):
            known = known[np.argsort(at.name[known])]
            _, of_noise = called(at.shift[known], at.name[known], alarm, clearness)
            best, evidence = called(at.shift[known], at.name[known], readings, clearness)
            seen = evidence > np.quantile(of_noise, 1.0 - ALARMS)
            right[which] += np.sum((best == at.name[drawn]) & seen)
            found[which] += np.sum(seen)
    most, least = right / found
    return float(most), float(least)


def called(
    known: np.ndarray, name: np.ndarray, readings: np.ndarray, clearness: float
) -> tuple[np.ndarray, np.ndarray]:
    """Most probable name of each reading (scalar, reading), and the evidence that alarms.

    Parameters
    ----------
    known, name
        Effects in the order of their names.
    """
    names, first = np.unique(name, return_index=True)
    sums = [np.logaddexp.reduceat(piece, first, axis=0) for piece in likelihoods(known, readings)]
    each = np.concatenate(sums, axis=1)
    total = np.logaddexp.reduce(each, axis=0)
    return names[np.argmax(each, axis=0)], total + clearness * (each.max(axis=0) - total)


def one_place(
    robot: Path, seed: int, index: int, effects: int, kind: str
) -> list[tuple[float, float]]:
    """Both shares of both alarms at one arm and campaign."""
    at = place(robot, seed, index, effects, kind)
    return [named(at, index, clearness) for clearness in WEIGHTS.values()]


def report(seed: int, places: int, effects: int, kind: str) -> Iterator[str]:
    """One line an alarm."""
    with workers() as pool:
        robots = [ROBOTS[index % len(ROBOTS)] for index in range(places)]
        given = ([seed] * places, range(places), [effects] * places, [kind] * places)
        shares = 100 * np.array(list(pool.map(one_place, robots, *given)))
    mean, error = shares.mean(axis=0), shares.std(axis=0, ddof=1) / places**0.5
    for alarm, (most, least), (wide, narrow) in zip(WEIGHTS, mean, error, strict=True):
        yield (
            f"{kind}: the best namer names {least:.1f} ± {narrow:.1f} % to {most:.1f} ± "
            f"{wide:.1f} % of what {alarm} detects right"
        )


def main() -> None:
    """Print the shares."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=("one", "other_forms"), default="one")
    parser.add_argument("--places", type=int, default=12, help="arms with a campaign each")
    parser.add_argument("--effects", type=int, default=20000, help="drawn at each place")
    options = parser.parse_args()
    for line in report(options.seed, options.places, options.effects, options.kind):
        sys.stdout.write(line + "\n")


if __name__ == "__main__":
    main()
