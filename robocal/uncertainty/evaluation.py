"""The whole evaluation of an identification: budget, parameters, tool, and what to believe."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.formats.bundle import Bundle
from robocal.identification.result import Identification
from robocal.uncertainty.agreement import Agreement, compare
from robocal.uncertainty.coverage import Interval, shortest_interval, symmetric_interval
from robocal.uncertainty.fitted_rows import FittedRows, fitted_rows
from robocal.uncertainty.monte_carlo import (
    BLOCK,
    Draws,
    Sampled,
    Stopping,
    sample,
    sample_adaptively,
)
from robocal.uncertainty.propagation import COVERAGE, coverage_factor, effective_nu
from robocal.uncertainty.refits import Refits, piece_size, refit, refit_piece
from robocal.uncertainty.repeats import Repeats, scatter_of_repeats
from robocal.uncertainty.sources import TEMPERATURE, Source, sources_of, total_covariance
from robocal.uncertainty.tool_draws import draw_parameters, tool_moves
from robocal.uncertainty.tool_pose import ToolUncertainty, tool_uncertainty
from robocal.uncertainty.verdict import Verdict, judge_intervals

DRAWN_POSES = 10
"""Poses at which the Monte Carlo method checks the law of propagation, spread over those asked"""
_MOST_BLOCKS = 100
QUICK_SHARE, JUDGING_SHARE = 0.5, 0.2
"""Of the tolerance that the draws meet: JCGM 101, 8.2 asks for a fifth where they judge the law of
propagation, at six times the draws; [1]"""
_TOO_WIDE = 0.03
"""Standard uncertainty of a parameter above which a straight line through the estimate no longer
follows the true dependence; draws are then refits [m, rad]"""
_REFIT_BLOCK = 2000
_MOST_REFIT_BLOCKS = 5


@dataclass(frozen=True)
class Settings:
    """How the draws are made.

    Parameters
    ----------
    seed
        Of all random numbers.
    digits
        Significant digits of the standard uncertainty that must be stable: the numerical tolerance.
    draws
        Number of draws; as many as the tolerance needs if None.
    refits
        Number of whole campaigns to simulate and fit.
    share
        Of the numerical tolerance that the draws meet.
    """

    seed: int = 1
    digits: int = 1
    draws: int | None = None
    refits: int = 0
    share: float = QUICK_SHARE


@dataclass(frozen=True)
class ParameterUncertainty:
    """Uncertainty of every parameter of the cell, zero where it did not move.

    Frames as `Identification.frame_std` reports them: as coordinates in the parent frame.
    """

    std: Float[Array, "parameter"]
    nu: Float[Array, "parameter"]
    expanded: Float[Array, "parameter"]
    shares: Float[Array, "parameter source"]


@dataclass(frozen=True)
class ToolCheck:
    """The Monte Carlo method at some poses; outputs are x, y, z of one pose after another."""

    poses: Int[Array, "drawn"]
    """Which of the poses."""
    sampled: Sampled
    agreement: Agreement
    radius: Float[Array, "drawn"]
    """Distance from the estimate that holds the probability [m]."""
    by_refits: bool
    """Draws are refits, as the parameters are too uncertain for a normal distribution."""


@dataclass(frozen=True)
class RefitCheck:
    """Simulated campaigns, fitted again."""

    count: int
    n_unsettled: int
    std: Float[Array, "parameter"]
    bias: Float[Array, "parameter"]
    """Mean of the refits less the estimate [m, rad]."""
    symmetric: Interval
    shortest: Interval
    """Of the parameters, about the estimate [m, rad]."""


@dataclass(frozen=True)
class Evaluation:
    """Everything that `uncertainty.json` tells."""

    settings: Settings
    result: Identification
    sources: tuple[Source, ...]
    repeats: Repeats
    verdict: Verdict
    parameters: ParameterUncertainty
    tool: ToolUncertainty
    check: ToolCheck
    refits: RefitCheck | None


def evaluate(
    bundle: Bundle,
    result: Identification,
    q: Float[Array, "pose joint"],
    settings: Settings = Settings(),
) -> Evaluation:
    """Evaluate the uncertainty of an identification and of the tool at joint readings.

    Parameters
    ----------
    bundle, result
        What was identified from what.
    q
        Where the tool's uncertainty is wanted [rad or m].

    Raises
    ------
    NoAnswer
        If the campaign wants Type A evaluation and has no repeats.

    References
    ----------
    .. [1] JCGM 100:2008 (GUM); JCGM 101:2008; JCGM 102:2011.
    """
    fit = fitted_rows(bundle, result)
    repeats = scatter_of_repeats(fit)
    sources = sources_of(fit, repeats)
    tool = tool_uncertainty(result.model, sources, q)
    again = _check_refits(fit, repeats, settings) if settings.refits else None
    return Evaluation(
        settings=settings,
        result=result,
        sources=sources,
        repeats=repeats,
        verdict=judge_intervals(fit, repeats),
        parameters=_parameters(sources, result.reported_from_own),
        tool=tool,
        check=_check_tool(fit, repeats, sources, tool, q, settings),
        refits=again,
    )


def _parameters(
    sources: tuple[Source, ...], reported: Float[Array, "parameter parameter"]
) -> ParameterUncertainty:
    """Of parameters as they are reported (`Identification.reported_from_own`)."""
    variances = np.stack(
        [
            np.einsum("ij,jk,ik->i", reported, source.covariance, reported, optimize=True)
            for source in sources
        ],
        axis=1,
    )
    total = variances.sum(axis=1)
    each = np.array([source.nu for source in sources])
    nu = np.array([effective_nu(own, each) for own in variances])
    std = np.sqrt(total)
    k = np.array([coverage_factor(value) for value in nu])
    shares = variances / np.where(total > 0, total, 1.0)[:, None]
    return ParameterUncertainty(std, nu, k * std, shares)


def _check_tool(
    fit: FittedRows,
    repeats: Repeats,
    sources: tuple[Source, ...],
    tool: ToolUncertainty,
    q: Float[Array, "pose joint"],
    settings: Settings,
) -> ToolCheck:
    poses = np.unique(np.linspace(0, len(q) - 1, min(len(q), DRAWN_POSES)).astype(int))
    too_wide = bool(np.sqrt(np.diag(total_covariance(sources))).max() > _TOO_WIDE)
    moves = _moves_by_refits(fit, repeats, sources) if too_wide else _normal_moves(sources)

    def draws(rng: np.random.Generator, count: int) -> Float[Array, "output draw"]:
        away = tool_moves(fit.result.model, moves(rng, count), q[poses])
        return away.reshape(-1, count)

    if settings.draws is None:
        block, most = (_REFIT_BLOCK, _MOST_REFIT_BLOCKS) if too_wide else (BLOCK, _MOST_BLOCKS)
        stopping = Stopping(digits=settings.digits, share=settings.share, most_blocks=most)
        sampled = sample_adaptively(draws, settings.seed, stopping, block)
    else:
        sampled = sample(draws, settings.seed, settings.draws)
    std = tool.position_std[poses].ravel()
    k = np.repeat([coverage_factor(nu) for nu in tool.nu[poses]], 3)
    agreement = compare(np.zeros(len(std)), std, k * std, sampled.symmetric, settings.digits)
    distance = np.linalg.norm(sampled.draws.reshape(len(poses), 3, -1), axis=1)
    radius = np.quantile(distance, COVERAGE, axis=1)
    return ToolCheck(poses, sampled, agreement, radius, too_wide)


def _normal_moves(sources: tuple[Source, ...]) -> Draws:
    def moves(rng: np.random.Generator, count: int) -> Float[Array, "parameter draw"]:
        return draw_parameters(sources, rng, count)

    return moves


def _moves_by_refits(fit: FittedRows, repeats: Repeats, sources: tuple[Source, ...]) -> Draws:
    later = tuple(source for source in sources if source.name == TEMPERATURE)
    size = piece_size(fit)

    def moves(rng: np.random.Generator, count: int) -> Float[Array, "parameter draw"]:
        pieces = [refit_piece(fit, repeats, size, rng).moves for _ in range(-(-count // size))]
        found = np.concatenate(pieces, axis=1)[:, :count]
        return found + draw_parameters(later, rng, count) if later else found

    return moves


def _check_refits(fit: FittedRows, repeats: Repeats, settings: Settings) -> RefitCheck:
    made: Refits = refit(fit, repeats, settings.refits, settings.seed)
    moves = fit.result.reported_from_own @ made.moves
    return RefitCheck(
        count=settings.refits,
        n_unsettled=made.n_unsettled,
        std=moves.std(axis=1, ddof=1),
        bias=moves.mean(axis=1),
        symmetric=symmetric_interval(moves, COVERAGE),
        shortest=shortest_interval(moves, COVERAGE),
    )
