r"""How large must a hidden effect be for any test whatever to find 95 % of them?

`python -m tests.studies.detection_bound --seed 1` prints what share the best of all tests detects
where the effect's strength is Lambda and 3 % of clean campaigns may raise an alarm. By the lemma of
Neyman and Pearson that test weighs all effects by how often they are drawn,

.. math:: T(y) = \frac{1}{K} \sum_k \exp(d_k^T W y - \tfrac12 d_k^T W d_k),

with :math:`d_k` what effect k adds to the readings and W the inverse covariance of the readings
under noise and unknown geometry. It is told what nobody knows: how often the emulated world draws
each effect, joint, order and moment, that the strength is Lambda, and the true arm about which the
geometry errs. The K effects are a sample. Where the hidden effect is one of them, T knows more than
there is to know: the share is too large. Where it is not, T lacks it: the share is too small.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.blind.trials import ROBOTS, workers
from tests.studies.drawn_effects import Place, likelihoods, place

STRENGTHS = (5.0, 5.5, 6.0, 6.5)
ALARMS = 0.03
"""Share of clean campaigns that may raise an alarm; [1]"""
NEAR = 1.5
"""Effects that came out within this factor of a strength stand for those of that strength; [1]"""
DRAWS = 4000
"""Of noise, for the threshold and for each share."""


def evidence(known: np.ndarray, readings: np.ndarray) -> np.ndarray:
    """Logarithm of T for whitened readings (scalar, reading), by the effects that it knows."""
    pieces = likelihoods(known, readings)
    return np.concatenate([np.logaddexp.reduce(piece, axis=0) for piece in pieces])


def detected(at: Place, strength: float, seed: int) -> tuple[float, float]:
    """Share detected where T knows the hidden effect, and where it does not."""
    rng = np.random.default_rng(seed)
    near = (at.strength < NEAR * strength) & (at.strength > strength / NEAR)
    shapes = at.shift[near] * (strength / at.strength[near])[:, None]
    shapes = rng.permutation(shapes)
    half = len(shapes) // 2
    noise, alarm = (rng.normal(size=(shapes.shape[1], DRAWS)) for _ in range(2))
    hidden = shapes[rng.integers(half, size=DRAWS)].T + noise

    def share(known: np.ndarray) -> float:
        threshold = np.quantile(evidence(known, alarm), 1.0 - ALARMS)
        return float((evidence(known, hidden) > threshold).mean())

    return share(shapes), share(shapes[half:])


def one_place(robot: Path, seed: int, index: int, effects: int) -> list[tuple[float, float]]:
    """Both shares at every strength."""
    at = place(robot, seed, index, effects)
    return [detected(at, strength, index) for strength in STRENGTHS]


def report(seed: int, places: int, effects: int) -> Iterator[str]:
    """One line a strength."""
    with workers() as pool:
        robots = [ROBOTS[index % len(ROBOTS)] for index in range(places)]
        given = ([seed] * places, range(places), [effects] * places)
        shares = np.array(list(pool.map(one_place, robots, *given)))
    mean, error = shares.mean(axis=0), shares.std(axis=0, ddof=1) / places**0.5
    for strength, (most, least), (wide, narrow) in zip(STRENGTHS, mean, error, strict=True):
        yield (
            f"Lambda {strength:g}: the best test detects {100 * least:.1f} ± {100 * narrow:.1f} % "
            f"to {100 * most:.1f} ± {100 * wide:.1f} %"
        )


def main() -> None:
    """Print the shares."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--places", type=int, default=12, help="arms with a campaign each")
    parser.add_argument("--effects", type=int, default=20000, help="drawn at each place")
    options = parser.parse_args()
    for line in report(options.seed, options.places, options.effects):
        sys.stdout.write(line + "\n")


if __name__ == "__main__":
    main()
