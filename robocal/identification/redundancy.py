"""Which parameters the measured poses can tell apart, and which move the target alike.

Columns of the whitened Jacobian are scaled to length one and taken in an order of preference: base
and tool first, then joint zeros and lengths, so that what is dropped is what the field drops: link
1 against the base, the last link against the tool, and beta, or d where axes are parallel. A column
that lies in the span of those already taken is redundant. One that stands out of it so little that
a move by the whole prior would change the residuals by less than their noise is weak: it stays in
the fit with its prior, but the data do not identify it.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.kinematics.model import KinematicModel, parameter_names

_SPAN_TOLERANCE = 1e-6
"""A column with less than this share of its length outside the span is redundant; exact redundancy
leaves 1e-12, the weakest real dependence seen (axes parallel to 0.01 mrad) 1e-5; [1]"""
_UNSEEN = 1e-12
_PARALLEL = 0.05
"""Angle below which the next axis counts as nominally parallel, as in robots.from_axes [rad]"""
_NAMED_SHARE = 0.05
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
    J = _compressed(J, free)
    kinds = sort_columns(J, order, free, prior_std)
    lengths = np.linalg.norm(J, axis=0)
    reasons = dict.fromkeys((names[k] for k in kinds.unseen), "these measurements do not see it")
    for index, before in kinds.redundant.items():
        column = J[:, index] / lengths[index]
        taken = kinds.taken[:before]
        span = kinds.span[:before]
        shares = np.linalg.solve(span @ (J[:, taken] / lengths[taken]), span @ column)
        reasons[names[index]] = _in_words(shares, taken, names)
    for index in kinds.weak:
        reasons[names[index]] = "the measurements say less of it than its prior does"
    identified, weak = np.zeros((2, len(names)), dtype=bool)
    identified[kinds.taken] = True
    weak[kinds.weak] = True
    sigma = np.linalg.svd(J[:, kinds.taken] / lengths[kinds.taken], compute_uv=False)
    condition = float(sigma[0] / sigma[-1]) if len(sigma) and sigma[-1] > 0 else float("inf")
    return Redundancy(identified, weak, reasons, len(kinds.taken), condition)


@dataclass(frozen=True)
class ColumnKinds:
    """Indices of the free columns, in order of preference."""

    taken: list[int]
    weak: list[int]
    redundant: dict[int, int]
    """With the number of columns taken before each, whose span it lies in."""
    unseen: list[int]
    span: Float[Array, "_ scalar"]
    """Orthonormal rows; the first k span the first k taken columns."""


def sort_columns(
    J: Float[Array, "scalar parameter"],
    order: list[int],
    free: Bool[Array, "parameter"],
    prior_std: Float[Array, "parameter"],
) -> ColumnKinds:
    """What `split_columns` decides, without saying why."""
    J = _compressed(J, free)
    lengths = np.linalg.norm(J, axis=0)
    unseen_below = _UNSEEN * lengths.max(initial=0.0)
    unit_columns = np.ascontiguousarray((J / np.maximum(lengths, unseen_below or 1.0)).T)
    kinds = ColumnKinds([], [], {}, [], np.zeros(J.shape[::-1]))
    for index in order:
        if not free[index]:
            continue
        if lengths[index] <= unseen_below:
            kinds.unseen.append(index)
            continue
        left = unit_columns[index]
        n_taken = len(kinds.taken)
        span = kinds.span[:n_taken]
        for _ in range(2):  # twice is enough against cancellation (Kahan)
            left = left - (span @ left) @ span
        outside = np.sqrt(left @ left)
        if outside < _SPAN_TOLERANCE:
            kinds.redundant[index] = n_taken
        elif outside * lengths[index] * prior_std[index] < _SEEN:
            kinds.weak.append(index)
        else:
            kinds.span[n_taken] = left / outside
            kinds.taken.append(index)
    return kinds


def _compressed(
    J: Float[Array, "scalar parameter"], free: Bool[Array, "parameter"]
) -> Float[Array, "_ parameter"]:
    """Fewer rows with the same products between free columns: the triangle of a QR factorisation.

    The other columns become zero.
    """
    n_free = np.count_nonzero(free)
    if len(J) <= n_free:
        return J
    triangle = np.zeros((n_free, J.shape[1]))
    triangle[:, free] = np.linalg.qr(J[:, free], mode="r")
    return triangle


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
    alike = [names[taken[k]] for k in strongest if abs(shares[k]) > _NAMED_SHARE][:6]
    if len(alike) == 1:
        return f"parallel to {alike[0]}"
    return f"moves the target as {', '.join(alike[:-1])} and {alike[-1]} do together"
