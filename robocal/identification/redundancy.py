"""Which parameters the measured poses can tell apart, and which move the target alike.

Columns of the whitened Jacobian are scaled to length one and taken in an order of preference: base
and tool first, then joint zeros and lengths, so that what is dropped is what the field drops: link
1 against the base, the last link against the tool, and beta, or d where axes are parallel. A column
that lies in the span of those already taken is redundant. One that stands out of it so little that
a move by the whole prior would change the residuals by less than their noise is weak: it stays in
the fit with its prior, but the data do not identify it.
"""

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array
from scipy.linalg.lapack import dgeqrf

from robocal.kinematics.model import KinematicModel, parameter_names

_SPAN_TOLERANCE = 1e-6
"""A column with less than this share of its length outside the span is redundant; exact redundancy
leaves 1e-12, the weakest real dependence seen (axes parallel to 0.01 mrad) 1e-5; [1]"""
_UNSEEN = 1e-12
_PARALLEL = 0.05
"""Angle below which the next axis counts as nominally parallel, as in robots.from_axes [rad]"""
_NAMED_SHARE, _MOST_NAMED = 0.05, 6
_TOLD_SHARE = 1e-3
_ROOM = 3.0
"""So many of their own prior standard deviations may the others move for a redundant one; [1]"""
_SEEN = 1.0
"""A parameter counts as seen when a move by its prior standard deviation changes the whitened
residuals by at least this much in all; [1]"""


@dataclass(frozen=True)
class Redundancy:
    """What the data can tell apart."""

    identified: Bool[Array, "parameter"]
    weak: Bool[Array, "parameter"]
    """Seen by the data less than by the prior."""
    reasons: dict[str, str]
    """Why each other parameter is not identified."""
    rank: int
    """Number of identified parameters."""
    condition: float
    """Largest over smallest singular value of the scaled columns of the identified parameters."""
    combinations: dict[str, dict[str, float]] = field(default_factory=dict)
    """Of a redundant parameter: how far others move the target as one unit of it does [m, rad].

    What is identified of another one is its own error and so many times the redundant one's.
    """


def find_redundancy(
    J: Float[Array, "scalar parameter"],
    model: KinematicModel,
    free: Bool[Array, "parameter"],
    prior_std: Float[Array, "parameter"],
) -> Redundancy:
    """Split the free geometric parameters of a robot with its frames; see `split_columns`."""
    return split_columns(J, parameter_names(model.n_joints), preference(model), free, prior_std)


def split_columns(
    J: Float[Array, "scalar parameter"],
    names: tuple[str, ...],
    order: list[int],
    free: Bool[Array, "parameter"],
    prior_std: Float[Array, "parameter"],
) -> Redundancy:
    """Split the free parameters into identified, weak and redundant ones.

    Parameters
    ----------
    J
        Whitened Jacobian of all parameters.
    names, order
        Names of the columns, and the order in which they are preferred.
    free
        Parameters that may be identified at all.
    prior_std
        How far each may be off before any measurement, infinite where nothing is known [m, rad].
    """
    kinds = sort_columns(J, order, free, prior_std)
    reasons = dict.fromkeys((names[k] for k in kinds.unseen), "these measurements do not see it")
    combinations: dict[str, dict[str, float]] = {}
    weak_ones = list(kinds.weak)
    lengths = np.linalg.norm(J, axis=0)
    for index, column in kinds.redundant.items():
        before = len(column)
        shares = np.linalg.solve(kinds.triangle[:before, :before], column)
        reasons[names[index]] = _in_words(shares, kinds.taken, names)
        others = kinds.taken[:before]
        moves = shares * lengths[index] / lengths[others]
        combinations[names[index]] = {
            names[other]: float(move)
            for other, move, share in zip(others, moves, shares, strict=True)
            if abs(share) > _TOLD_SHARE
        }
        room = _ROOM * prior_std[others]
        # What has no prior cannot be kept by it.
        if np.isfinite(prior_std[index]) and (np.abs(moves) * prior_std[index] > room).any():
            weak_ones.append(index)
            reasons[names[index]] += "; kept with its prior, they could not move as far"
    for index in kinds.weak:
        reasons[names[index]] = "the measurements say less of it than its prior does"
    identified, weak = np.zeros((2, len(names)), dtype=bool)
    identified[kinds.taken] = True
    weak[weak_ones] = True
    sigma = np.linalg.svd(kinds.triangle, compute_uv=False)
    condition = float(sigma[0] / sigma[-1]) if len(sigma) and sigma[-1] > 0 else float("inf")
    return Redundancy(identified, weak, reasons, len(kinds.taken), condition, combinations)


@dataclass(frozen=True)
class ColumnKinds:
    """Indices of the free columns, in order of preference."""

    taken: list[int]
    weak: list[int]
    redundant: dict[int, Float[Array, "_"]]
    """With what each, scaled to length one, has along the basis of the columns taken before it."""
    unseen: list[int]
    triangle: Float[Array, "taken taken"]
    """The taken columns, scaled to length one, in that basis."""


def sort_columns(
    J: Float[Array, "scalar parameter"],
    order: list[int],
    free: Bool[Array, "parameter"],
    prior_std: Float[Array, "parameter"],
) -> ColumnKinds:
    """What `split_columns` decides, without saying why.

    The diagonal of a QR factorisation is what each column has outside the span of those before it.
    The first column with too little is left out, and what comes after it is factorised again.
    """
    lengths = np.sqrt(np.einsum("sp,sp->p", J, J))
    seen = lengths > _UNSEEN * lengths.max(initial=0.0)
    left = [index for index in order if free[index] and seen[index]]
    least = np.maximum(_SPAN_TOLERANCE, _SEEN / (lengths[left] * prior_std[left]))
    R = _triangle(J[:, left] / lengths[left])
    weak: list[int] = []
    redundant: dict[int, Float[Array, "_"]] = {}
    while True:
        diagonal = np.abs(R.diagonal())
        outside = diagonal
        if len(diagonal) < len(left):
            outside = np.concatenate([diagonal, np.zeros(len(left) - len(diagonal))])
        short = np.flatnonzero(outside < least)
        if not len(short):
            break
        first = int(short[0])
        index = left.pop(first)
        if outside[first] < _SPAN_TOLERANCE:
            redundant[index] = R[:first, first]
        else:
            weak.append(index)
        least = np.concatenate([least[:first], least[first + 1 :]])
        R = _without_column(R, first)
    unseen = [index for index in order if free[index] and not seen[index]]
    return ColumnKinds(left, weak, redundant, unseen, R[: len(left)])


def _triangle(columns: Float[Array, "row column"]) -> Float[Array, "_ column"]:
    """Upper triangle of a QR factorisation."""
    # LAPACK itself: on so few columns numpy's wrapper takes longer than the factorisation.
    R = dgeqrf(columns)[0][: columns.shape[1]]
    return np.asarray(R * _upper(*R.shape))


@lru_cache(maxsize=128)
def _upper(rows: int, columns: int) -> Float[Array, "rows columns"]:
    """Ones on and above the diagonal."""
    return np.triu(np.ones((rows, columns)))


def _without_column(R: Float[Array, "row column"], index: int) -> Float[Array, "row _"]:
    """Triangle of the other columns."""
    rest = np.concatenate([R[:, :index], R[:, index + 1 :]], axis=1)
    if index < min(rest.shape):
        tail = _triangle(rest[index:, index:])
        rest[index:, index:] = 0.0
        rest[index : index + len(tail), index:] = tail
    return rest


def preference(model: KinematicModel, n_more: int = 0) -> list[int]:
    """Parameter indices, those to keep first; nests and anchor (`n_more`) follow the frames."""
    n = 5 * model.n_joints
    order = list(range(n, n + 12 + n_more))
    for parameter in (0, 2, 3):
        order += [5 * joint + parameter for joint in range(model.n_joints)]
    alpha, beta = model.links[:, 3], model.links[:, 4]
    parallel = (np.abs(np.sin(alpha)) < _PARALLEL) & (np.abs(beta) < _PARALLEL)
    parallel[-1] = False
    later = []
    for joint, no_d in enumerate(parallel.tolist()):
        keep, drop = (4, 1) if no_d else (1, 4)
        order.append(5 * joint + keep)
        later.append(5 * joint + drop)
    return order + later


def _in_words(shares: Float[Array, "_"], taken: list[int], names: tuple[str, ...]) -> str:
    """The identified parameters that together, by their shares, move the target as this one."""
    strongest = np.argsort(-np.abs(shares))
    alike = [names[taken[k]] for k in strongest if abs(shares[k]) > _NAMED_SHARE]
    if len(alike) == 1:
        return f"parallel to {alike[0]}"
    if len(alike) > _MOST_NAMED:
        more = len(alike) - _MOST_NAMED
        return f"moves the target as {', '.join(alike[:_MOST_NAMED])} and {more} others do together"
    return f"moves the target as {', '.join(alike[:-1])} and {alike[-1]} do together"
