"""Effects, and the rows that belong, chosen in turn until they agree."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Int
from numpy import ndarray as Array

from robocal.diagnosis.alarm import null_threshold
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effects.settling import Settling
from robocal.diagnosis.joint_fit import JointFit, fit_jointly
from robocal.diagnosis.judged_again import score_again
from robocal.diagnosis.select import Limits, select_effects
from robocal.diagnosis.target_distances import Targets
from robocal.diagnosis.thinning import chosen_rows, evenly
from robocal.identification.adequacy import LEAST_NU
from robocal.identification.observations import Observations
from robocal.identification.outliers import REJECT, REJECT_GROSS, is_settled
from robocal.identification.solve import Solution

FALSE_ALARM = 0.025
"""Chance that clean data have anything named; [1]"""
MOST_OUTLYING = 0.08
"""Share of rows up to which they are outliers; more are an effect, such as all after a step; [1]"""
_ROUNDS = 3
"""Times that effects are chosen at most; [1]"""
_NULL_DRAWS = 400
_NULL_ROWS = 300
_MOST_SMALL, _MOST_LARGE = 10, 60
"""Effects at most, with few and with many rows; [1]"""
MANY_ROWS = 600
"""With more, dozens of effects stand for structure, and choosing takes long; [1]"""


@dataclass(frozen=True)
class Steps:
    """What came out on the way.

    Parameters
    ----------
    rows, fitted
        Rows of the fit, and their indices among all.
    geometric, found
        The fit without effects, and with them.
    limits
        What the effects were chosen by; None where too little is left over to choose by.
    unpredicted
        Which of the rows that may take part were left out because no model can predict them.
    """

    rows: Circumstances
    fitted: Int[Array, "row"]
    geometric: JointFit
    found: JointFit
    limits: Limits | None
    unpredicted: Bool[Array, "candidate"]


def find_effects(
    targets: Targets, observed: Observations, solution: Solution, candidates: Int[Array, "row"]
) -> tuple[Solution, Steps]:
    """Choose effects; where with them other rows belong, choose again on these.

    Parameters
    ----------
    targets
        All rows.
    observed, candidates
        Those that may take part, and their indices among all.
    solution
        The geometry alone, and which of these rows took part.
    """
    begun = solution, _choose(targets, solution, candidates)
    solution, steps = begun
    for _ in range(_ROUNDS - 1):
        again = _belonging(targets, observed, solution, steps, candidates)
        if again is None:
            break
        unpredicted = _unpredicted(steps, candidates) & ~again.used
        solution = again
        steps = replace(_choose(targets, solution, candidates), unpredicted=unpredicted)
        if not steps.found.effects:
            # Only rows that do not belong spoke for it: nothing, and the rows of the geometry.
            solution, steps = begun
            return solution, replace(steps, found=steps.geometric)
    return solution, steps


def _choose(targets: Targets, solution: Solution, candidates: Int[Array, "row"]) -> Steps:
    """Effects from the rows that took part."""
    fitted = candidates[solution.used]
    rows = targets.around.rows(chosen_rows(fitted, len(targets.measured)))
    geometric = fit_jointly(solution.problem, solution.fit.cell, rows, ())
    none = np.zeros(len(candidates), dtype=bool)
    if geometric.nu < LEAST_NU:
        # Hardly anything is left over: evidence and threshold are both rounding.
        return Steps(rows, fitted, geometric, geometric, None, none)
    most = _MOST_LARGE if len(rows) > MANY_ROWS else _MOST_SMALL
    limits = Limits(_threshold(rows, geometric), most)
    found = select_effects(solution.problem, solution.fit.cell, rows, limits)
    return Steps(rows, fitted, geometric, found, limits, none)


def _unpredicted(steps: Steps, candidates: Int[Array, "row"]) -> Bool[Array, "row"]:
    """The first row where a joint settles: nobody knows from where the arm came to it."""
    return np.asarray((candidates == 0) & settles(steps.found))


def settles(found: JointFit) -> bool:
    """Whether a joint settles in this model."""
    return any(fitted.instance.effect == Settling.name for fitted in found.effects)


def _belonging(
    targets: Targets,
    observed: Observations,
    solution: Solution,
    steps: Steps,
    candidates: Int[Array, "row"],
) -> Solution | None:
    """The rows that belong once the effects are in; None where these are the same."""
    # With many rows dozens of effects stand for structure: no row's own error is told by them.
    if not steps.found.effects or len(steps.rows) > MANY_ROWS:
        return None
    around = targets.around.rows(chosen_rows(candidates, len(targets.measured)))
    scores = score_again(steps.found, observed, around, solution.used)
    # A row that fitted the geometry goes only where it is grossly off: the form of an effect errs.
    fits = scores.chance >= np.where(solution.used, REJECT_GROSS, REJECT)
    unpredicted = _unpredicted(steps, candidates)
    if np.mean(~fits & ~unpredicted) > MOST_OUTLYING:
        fits = solution.used
    used = fits & ~unpredicted
    if is_settled(used, solution.used):
        return None
    problem = replace(solution.problem, rows=observed.choose(used))
    return replace(solution, problem=problem, used=used, scores=scores)


def _threshold(rows: Circumstances, geometric: JointFit) -> float:
    """Null threshold, from some of the rows where there are many: their number hardly matters."""
    few = evenly(len(rows), _NULL_ROWS)
    part = geometric.fit.some_rows(few)
    return null_threshold(rows.rows(few), part, FALSE_ALARM, _NULL_DRAWS, seed=1)
