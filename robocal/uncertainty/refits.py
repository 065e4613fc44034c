"""Monte Carlo of the whole identification: simulated readings of the estimate, fitted again.

Holds without the linearisation that the covariance rests on. Draws are made in pieces, each with a
generator of its own made of seed and number, so that any number of processes gives the same.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.instrument import InstrumentNoise
from robocal.progress import counted
from robocal.uncertainty.budget import ReadingsBy
from robocal.uncertainty.fitted_rows import FittedRows
from robocal.uncertainty.many_fits import Estimator, Readings, fit_many
from robocal.uncertainty.monte_carlo import block_generator
from robocal.uncertainty.repeats import Repeats
from robocal.uncertainty.simulated_readings import simulate_readings, turn_axes
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


ForEach = Callable[[Callable[[int], Refits], range], Iterable[Refits]]


def refit(fit: FittedRows, repeats: Repeats, draws: int, seed: int, each: ForEach = map) -> Refits:
    """Simulate and fit so many campaigns.

    Parameters
    ----------
    seed
        Every piece has a generator of its own made of seed and number.
    each
        Applies a function to every number and gives the results in order: `map`, or the `map` of
        an executor of any number of processes, which changes no bit of the result.
    """
    size = piece_size(fit)
    numbered = partial(_numbered_piece, fit, repeats, size, seed)
    count = -(-draws // size)
    made = each(numbered, range(count))
    pieces = list(counted("simulated campaigns, fitted", made, count))
    moves = np.concatenate([piece.moves for piece in pieces], axis=1)[:, :draws]
    return Refits(moves, sum(piece.n_unsettled for piece in pieces))


def _numbered_piece(fit: FittedRows, repeats: Repeats, size: int, seed: int, piece: int) -> Refits:
    return refit_piece(fit, repeats, size, block_generator(seed, piece))


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
        fit.measured.visit,
        _noise_to_draw(fit, repeats),
        fit.bundle.budget,
        rng,
    )
    if fit.drift_errors is not None:
        readings = _drifted(readings, fit, fit.drift_errors, rng)
    precision = fit.prior_precision
    # A wide prior states nothing; drawing its mean would move the frames by metres.
    stated = ~is_wide(fit)
    spread = np.where(stated, 1.0 / np.sqrt(np.where(stated, precision, 1.0)), 0.0)
    prior_mean = estimate[fit.free] + spread[:, None] * rng.normal(size=(len(fit.free), count))
    found = fit_many(Estimator(fit.cell, fit.rows, fit.free, precision), readings, prior_mean)
    return Refits(found.vectors - estimate, int((~found.settled).sum()))


def _drifted(
    readings: Readings,
    fit: FittedRows,
    errors: Float[Array, "row 6 noise"],
    rng: np.random.Generator,
) -> Readings:
    """Readings from which a drift was taken that noisy nests showed."""
    noise = rng.normal(size=(errors.shape[2], readings.position.shape[1]))
    moved = np.einsum("mpk,kd->pdm", errors, noise, optimize=True)
    return replace(
        readings,
        position=readings.position + moved[:3] * (fit.rows.position_weight > 0),
        axes=turn_axes(readings.axes, moved[3:]),
    )


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
