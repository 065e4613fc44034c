"""Monte Carlo of the whole identification: simulated readings of the estimate, fitted again.

Holds without the linearisation that the covariance rests on. Draws are made in pieces, each with a
generator of its own made of seed and number, so that any number of processes gives the same.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.instrument import InstrumentNoise
from robocal.uncertainty.budget import ReadingsBy
from robocal.uncertainty.fitted_rows import FittedRows
from robocal.uncertainty.many_fits import Estimator, fit_many
from robocal.uncertainty.monte_carlo import block_generator
from robocal.uncertainty.repeats import Repeats, visits
from robocal.uncertainty.simulated_readings import simulate_readings
from robocal.uncertainty.sources import OPEN_FRAMES, TEMPERATURE, Source, is_wide

_COLUMNS = 2000
"""Draws times rows of a piece: the arrays of so many stay in the cache"""


@dataclass(frozen=True)
class Refits:
    """Parameters of all refits less those of the estimate."""

    moves: Float[Array, "parameter draw"]
    """[m, rad]"""
    n_unsettled: int
    """Draws that did not come to rest; they are counted in `moves` all the same."""


def refit(fit: FittedRows, repeats: Repeats, draws: int, seed: int) -> Refits:
    """Simulate and fit so many campaigns."""
    size = piece_size(fit)
    pieces = [
        refit_piece(fit, repeats, size, block_generator(seed, piece))
        for piece in range(-(-draws // size))
    ]
    moves = np.concatenate([piece.moves for piece in pieces], axis=1)[:, :draws]
    return Refits(moves, sum(piece.n_unsettled for piece in pieces))


def piece_size(fit: FittedRows) -> int:
    """Draws in a piece."""
    return max(1, _COLUMNS // len(fit.rows))


def refit_piece(fit: FittedRows, repeats: Repeats, count: int, rng: np.random.Generator) -> Refits:
    """The draws of one piece; pieces may be computed anywhere and in any order."""
    estimate = np.repeat(fit.cell.vector[:, None], count, axis=1)
    readings = simulate_readings(
        fit.cell,
        estimate,
        fit.rows,
        visits(fit),
        _noise_to_draw(fit, repeats),
        fit.bundle.budget,
        rng,
    )
    precision = fit.prior_precision
    # A wide prior states nothing; drawing its mean would move the frames by metres.
    stated = ~is_wide(fit)
    spread = np.where(stated, 1.0 / np.sqrt(np.where(stated, precision, 1.0)), 0.0)
    prior_mean = estimate[fit.free] + spread[:, None] * rng.normal(size=(len(fit.free), count))
    found = fit_many(Estimator(fit.cell, fit.rows, fit.free, precision), readings, prior_mean)
    return Refits(found.vectors - estimate, int((~found.settled).sum()))


def _noise_to_draw(fit: FittedRows, repeats: Repeats) -> InstrumentNoise:
    """The declared noise, or that of the repeats; the target's error is drawn once a visit."""
    noise = replace(fit.bundle.instrument, target=0.0)
    if fit.bundle.budget.readings is ReadingsBy.declared:
        return noise
    position = 1.0 if repeats.position is None else np.sqrt(repeats.position.ratio)
    turn = 1.0 if repeats.orientation is None else np.sqrt(repeats.orientation.ratio)
    return InstrumentNoise(
        fixed=noise.fixed * position,
        per_range=noise.per_range * position,
        orientation=noise.orientation * turn,
        repeatability=noise.repeatability * position,
        orientation_repeatability=noise.orientation_repeatability * turn,
    )


def seen_by_refits(sources: tuple[Source, ...]) -> tuple[Source, ...]:
    """The sources that refits simulate; the temperature acts after the campaign."""
    return tuple(source for source in sources if source.name not in (TEMPERATURE, OPEN_FRAMES))
