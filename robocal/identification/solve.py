"""From rows and a start to the minimum: structure, fit, and a second look at what the data see."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.outliers import RowScores, is_settled, score_rows
from robocal.identification.priors import Choices, prior_std
from robocal.identification.problem import whitened_jacobian
from robocal.identification.redundancy import (
    ColumnKinds,
    Redundancy,
    preference,
    sort_columns,
    split_columns,
)
from robocal.identification.strategy import Fit, Problem, Strategy
from robocal.progress import tell

_GENERIC_ROWS = 60
"""As many scalars as there are parameters, with plenty to spare"""
_GENERIC_TURN, _GENERIC_SLIDE = 1.5, 0.3
"""How far joints are spread to see what well-spread poses would tell [rad], [m]"""
_MAX_SECOND_LOOKS = 3
MAX_REJECTIONS = 10


@dataclass(frozen=True)
class Solution:
    """A minimum and what it was made of."""

    fit: Fit
    problem: Problem
    redundancy: Redundancy
    """As the start saw it; parameters that only the solution shows are among the weak ones."""
    used: Bool[Array, "row"]
    """Rows that took part."""
    scores: RowScores

    @property
    def covariance(self) -> Float[Array, "free free"]:
        """Of the free parameters, prior included."""
        return covariance_of(self.fit)

    @property
    def chi_square(self) -> float:
        """Sum of the squared whitened residuals."""
        return 2.0 * self.fit.minimum.equations.cost

    @property
    def nu(self) -> float:
        """Measured scalars less what the fit took out of them: the trace of the hat matrix."""
        taken = float(np.sum(self.covariance * self.fit.minimum.equations.hessian))
        return self.problem.rows.n_scalars - taken


def covariance_of(fit: Fit) -> Float[Array, "free free"]:
    """Inverse of the Hessian."""
    return scaled_inverse(fit.minimum.hessian)


def scaled_inverse(hessian: Float[Array, "n n"]) -> Float[Array, "n n"]:
    """Inverse through the scaled form: unknowns are in m, rad and whatever effects come in."""
    scale = 1.0 / np.sqrt(np.diag(hessian))
    scaled = np.linalg.inv(hessian * np.outer(scale, scale))
    return np.asarray(0.5 * (scaled + scaled.T) * np.outer(scale, scale))


def structure(cell: CellModel, rows: Observations, std: Float[Array, "parameter"]) -> Redundancy:
    """What the rows can tell apart, and why not the rest."""
    J, order = _columns(cell, rows, std)
    return split_columns(J, cell.names, order, std > 0.0, std)


def column_kinds(
    cell: CellModel, rows: Observations, std: Float[Array, "parameter"]
) -> ColumnKinds:
    """What the rows can tell apart."""
    J, order = _columns(cell, rows, std)
    return sort_columns(J, order, std > 0.0, std)


def _columns(
    cell: CellModel, rows: Observations, std: Float[Array, "parameter"]
) -> tuple[Float[Array, "scalar parameter"], list[int]]:
    """Whitened Jacobian of the rows that stand for all, and the order of preference.

    What is asked to be free comes before all others, so that of parameters that move the target
    alike the one asked for is identified.
    """
    J = whitened_jacobian(cell, rows.representative, np.arange(len(cell.names)))
    n_more = len(cell.names) - cell.geometry.n_parameters
    order, asked = preference(cell.geometry, n_more), np.isinf(std)
    return J, sorted(order, key=lambda index: not asked[index]) if asked.any() else order


def frames_alone(start: CellModel, rows: Observations, choices: Choices, how: Strategy) -> Fit:
    """Nominal links; base, tool, nests and anchor fitted."""
    return how(frames_problem(start, rows, choices))


def frames_problem(start: CellModel, rows: Observations, choices: Choices) -> Problem:
    """Base, tool, nests and anchor, as far as the rows show them."""
    std = prior_std(start, choices)
    std[: 5 * start.geometry.n_joints] = 0.0
    free = np.sort(np.array(column_kinds(start, rows, std).taken, dtype=int))
    return problem_of(start, rows, free, std)


def solve(
    start: CellModel,
    rows: Observations,
    choices: Choices,
    how: Strategy,
    centre: CellModel | None = None,
) -> Solution:
    """Fit, and fit again while the solution shows parameters that the start could not.

    At nominal geometry exact symmetries (parallel axes) hide parameters that the real, slightly
    skew robot shows; these join the fit with their priors.

    Parameters
    ----------
    start
        Where to begin.
    rows
        Rows to fit.
    choices
        Parameters fixed, free or with priors of their own.
    how
        Way to the minimum.
    centre
        Where the priors are centred, its links nominal; the start if None.

    Raises
    ------
    BadInput
        If the measurements determine no parameter that may move.
    """
    std = prior_std(start, choices)
    centre = centre or start
    redundancy = structure(centre, rows, std)
    if np.isinf(std).any():
        # Free, but parallel to others: where the solution shows it, nothing would hold it.
        std = prior_std(start, choices.without_free(redundancy.reasons))
    redundancy = _with_unexercised(redundancy, centre, rows, std)
    free = redundancy.identified | redundancy.weak
    if not redundancy.identified.any():
        raise BadInput(
            "campaign.yaml",
            "leaves no parameter to identify: each is fixed (parameters.fixed, --fix), or the "
            "declared noise (instrument.sigma_mm) hides it; leave some free and state the noise "
            "as the certificate has it",
        )
    problem = problem_of(start, rows, np.flatnonzero(free), std, centre)
    fit = how(problem)
    for _ in range(_MAX_SECOND_LOOKS):
        now = column_kinds(fit.cell, rows, std)
        fresh = np.zeros(len(free), dtype=bool)
        fresh[now.taken + now.weak] = True
        fresh &= ~free
        if not fresh.any():
            break
        free |= fresh
        redundancy = _with_weak(redundancy, fresh, fit.cell.names)
        problem = replace(problem, start=fit.cell, free=np.flatnonzero(free))
        fit = replace(how(problem), iterations=fit.iterations + 1)
    used = np.ones(len(rows), dtype=bool)
    scores = score_rows(fit.cell, rows, problem.free, covariance_of(fit), used)
    return Solution(fit, problem, redundancy, used, scores)


def solve_without_outliers(
    start: CellModel,
    rows: Observations,
    choices: Choices,
    how: Strategy,
    centre: CellModel | None = None,
) -> Solution:
    """Like `solve`, leaving out rows that do not belong; every row is judged anew in each round."""
    tell("fitting the geometry")
    solution = solve(start, rows, choices, how, centre)
    for _ in range(MAX_REJECTIONS):
        used = ~solution.scores.outlying
        if is_settled(used, solution.used):
            break
        problem = replace(solution.problem, start=solution.fit.cell, rows=rows.choose(used))
        fit = how(problem)
        fit = replace(fit, iterations=fit.iterations + solution.fit.iterations)
        scores = score_rows(fit.cell, rows, problem.free, covariance_of(fit), used)
        solution = Solution(fit, problem, solution.redundancy, used, scores)
    return solution


def problem_of(
    start: CellModel,
    rows: Observations,
    free: Int[Array, "free"],
    std: Float[Array, "parameter"],
    centre: CellModel | None = None,
) -> Problem:
    """A problem with priors of these standard deviations about `centre` (else the start)."""
    with np.errstate(divide="ignore"):
        precision = np.where(np.isfinite(std), 1.0 / std**2, 0.0)
    precision[std == 0.0] = 0.0
    return Problem(start, rows, free, (centre or start).vector, precision)


def full_rank(cell: CellModel, rows: Observations) -> int:
    """Parameters that well-spread rows of this kind determine.

    4 a revolute joint, 2 a prismatic one, and the frames: 6 for full poses, 3 a measured point,
    less 3 where only lengths were measured.
    """
    prismatic = int(np.count_nonzero(cell.geometry.prismatic))
    chain = 4 * (cell.geometry.n_joints - prismatic) + 2 * prismatic
    return chain + _targets_rank(cell, rows)


def frames_rank(cell: CellModel, rows: Observations) -> int:
    """Parameters of base, tool and nests that such rows determine of a robot that is known."""
    return 6 + _targets_rank(cell, rows)


def _targets_rank(cell: CellModel, rows: Observations) -> int:
    if rows.has_orientation:
        return 6 + 3 * len(cell.place_names)
    return 3 * len(np.unique(rows.place)) - (0 if rows.has_position else 3)


def _with_unexercised(
    redundancy: Redundancy,
    cell: CellModel,
    rows: Observations,
    std: Float[Array, "parameter"],
) -> Redundancy:
    """Keep parameters with their priors that only these joints leave open.

    A true gauge moves the target alike at every pose and may stand at its nominal value. What is
    redundant only because a joint stood still is unknown elsewhere, and its prior must say so.
    """
    held = redundancy.identified | redundancy.weak
    if redundancy.rank >= full_rank(cell, rows):
        return redundancy
    settled = held | (std == 0.0) | _same_shift(cell, redundancy.identified)
    if settled.all():
        return redundancy
    few = rows.representative
    if len(few) < _GENERIC_ROWS:
        few = few.choose(np.linspace(0, len(few) - 1, _GENERIC_ROWS).astype(int))
    spread = np.where(cell.geometry.prismatic, _GENERIC_SLIDE, _GENERIC_TURN)
    noise = np.random.default_rng(0).normal(size=few.joints.shape)
    anywhere = column_kinds(cell, replace(few, joints=few.joints + noise * spread), std)
    told_elsewhere = np.zeros(len(cell.names), dtype=bool)
    told_elsewhere[anywhere.taken + anywhere.weak] = True
    told_elsewhere &= ~held
    reasons = dict(redundancy.reasons)
    for index in np.flatnonzero(told_elsewhere):
        reasons[cell.names[index]] += "; at these poses only: its prior stands for it elsewhere"
    return replace(redundancy, weak=redundancy.weak | told_elsewhere, reasons=reasons)


def _same_shift(cell: CellModel, identified: Bool[Array, "parameter"]) -> Bool[Array, "parameter"]:
    """Shifts along an axis exactly parallel to a later one whose shift is identified.

    They move the target alike at every pose, so that no other pose has to be tried.
    """
    same = np.zeros(len(identified), dtype=bool)
    parallel = (cell.geometry.links[:, 3:5] == 0.0).all(axis=1)
    for joint in np.flatnonzero(parallel[:-1])[::-1]:
        following = 5 * (joint + 1) + 1
        same[5 * joint + 1] = identified[following] or same[following]
    return same


def _with_weak(
    redundancy: Redundancy, fresh: Bool[Array, "parameter"], names: tuple[str, ...]
) -> Redundancy:
    reasons = dict(redundancy.reasons)
    for index in np.flatnonzero(fresh):
        reasons[names[index]] += (
            "; only the robot's own skewness shows it, hardly more than its prior"
        )
    return replace(redundancy, weak=redundancy.weak | fresh, reasons=reasons)
