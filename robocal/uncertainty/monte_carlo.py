"""Propagation of distributions by the adaptive Monte Carlo procedure of JCGM 101.

Blocks of draws are added until twice the standard deviation of the averaged estimate, standard
uncertainty and interval ends is below the numerical tolerance of each output.

References
----------
.. [1] JCGM 101:2008, 7.9.4.
.. [2] G. Wuebbeler, P. M. Harris, M. G. Cox, C. Elster, Metrologia 47 (2010) 317-324.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.progress import tell
from robocal.uncertainty.coverage import (
    Interval,
    numerical_tolerance,
    shortest_interval,
    symmetric_interval,
)
from robocal.uncertainty.distributions import Distribution
from robocal.uncertainty.propagation import COVERAGE, Function

BLOCK = 10_000
"""Least number of draws in a block: JCGM 101, 7.9.4 b"""
_FEWEST_BLOCKS = 5
"""The procedure allows two, whose own scatter now and then is small by luck; [2]"""

Draws = Callable[[np.random.Generator, int], Float[Array, "output draw"]]


@dataclass(frozen=True)
class Sampled:
    """What the draws of all blocks together say of each output."""

    mean: Float[Array, "output"]
    std: Float[Array, "output"]
    symmetric: Interval
    shortest: Interval
    draws: Float[Array, "output draw"]
    stable: bool
    """Whether every output is known to have met its tolerance."""

    @property
    def n_draws(self) -> int:
        """Number of draws."""
        return int(self.draws.shape[1])


@dataclass(frozen=True)
class Stopping:
    """When to stop.

    Parameters
    ----------
    digits
        Significant digits of the standard uncertainty that must not change.
    share
        Of the numerical tolerance that is to be met; less than one where the draws are to judge
        the law of propagation (JCGM 101, 8.2).
    most_blocks
        Blocks at most; fewer draws than the tolerance asks for are reported, not hidden.
    """

    coverage: float = COVERAGE
    digits: int = 1
    share: float = 1.0
    most_blocks: int = 200


def sample_adaptively(
    draws: Draws, seed: int, stopping: Stopping = Stopping(), block: int = BLOCK
) -> Sampled:
    """Draw blocks until all outputs are numerically stable.

    Parameters
    ----------
    draws
        Makes so many draws of every output.
    seed
        Every block has a generator of its own made of seed and block number, so that blocks may be
        computed anywhere.
    block
        Draws in a block, raised to the least that the coverage needs.
    """
    parts: list[Float[Array, "output draw"]] = []
    figures: list[Float[Array, "figure output"]] = []
    size = max(block, int(np.ceil(100.0 / (1.0 - stopping.coverage))))
    stable = False
    while not stable and len(parts) < stopping.most_blocks:
        tell("blocks of draws", len(parts))
        parts.append(draws(block_generator(seed, len(parts)), size))
        figures.append(_figures(parts[-1], stopping.coverage))
        stable = len(parts) >= _FEWEST_BLOCKS and _is_stable(figures, stopping)
    return _summary(np.concatenate(parts, axis=1), stopping.coverage, stable=stable)


def sample(draws: Draws, seed: int, count: int, coverage: float = COVERAGE) -> Sampled:
    """So many draws and no more: JCGM 101, 7.2. Nobody checked whether they are stable."""
    return _summary(draws(block_generator(seed, 0), count), coverage, stable=False)


def _summary(together: Float[Array, "output draw"], coverage: float, *, stable: bool) -> Sampled:
    return Sampled(
        mean=together.mean(axis=1),
        std=together.std(axis=1, ddof=1),
        symmetric=symmetric_interval(together, coverage),
        shortest=shortest_interval(together, coverage),
        draws=together,
        stable=stable,
    )


def block_generator(seed: int, block: int) -> np.random.Generator:
    """Generator of one block, independent of the others."""
    return np.random.default_rng([seed, block])


def draws_of(
    function: Function,
    inputs: Sequence[Distribution],
    correlation: Float[Array, "input input"] | None = None,
) -> Draws:
    """Draws of one output of a measurement function.

    Parameters
    ----------
    correlation
        Of normal inputs (JCGM 101, 6.4.8); independent if None.
    """

    def independent(rng: np.random.Generator, count: int) -> Float[Array, "1 draw"]:
        values = np.stack([quantity.draw(rng, count) for quantity in inputs])
        return function(values)[None]

    if correlation is None:
        return independent
    root = np.linalg.cholesky(correlation)
    x = np.array([quantity.estimate for quantity in inputs])[:, None]
    u = np.array([quantity.std for quantity in inputs])[:, None]

    def together(rng: np.random.Generator, count: int) -> Float[Array, "1 draw"]:
        return function(x + u * (root @ rng.normal(size=(len(x), count))))[None]

    return together


def _figures(part: Float[Array, "output draw"], coverage: float) -> Float[Array, "4 output"]:
    interval = symmetric_interval(part, coverage)
    return np.stack([part.mean(axis=1), part.std(axis=1, ddof=1), interval.low, interval.high])


def _is_stable(
    summaries: list[Float[Array, "figure output"]],
    stopping: Stopping,
) -> bool:
    """JCGM 101, 7.9.4 g to l."""
    figures = np.stack(summaries)
    of_average = figures.std(axis=0, ddof=1) / np.sqrt(len(figures))
    pooled = np.sqrt((figures[:, 1] ** 2).mean(axis=0))
    tolerance = stopping.share * numerical_tolerance(pooled, stopping.digits)
    return bool((2.0 * of_average <= tolerance).all())
