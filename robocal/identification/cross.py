"""Cross identification: orientation rows for the angles, then all rows for everything, in turn.

Steps S31 to S33 of the patent CN117067221B: S31 fits the angular parameters to the orientation
errors alone, S32 fits all parameters to all errors from there, S33 repeats until the cost no
longer falls. A round that raises the cost is dropped.
"""

from robocal.identification.least_squares import MAX_ITERATIONS, Minimum
from robocal.identification.strategy import Fit, Problem

_STAGE_ITERATIONS = 20
_MAX_ROUNDS = 20
_COST_TOLERANCE = 1e-9
"""Stop when a round lowers the cost by less than this share; [1]"""


def identify_crosswise(problem: Problem) -> Fit:
    """Alternate between the two stages; without orientation rows only the second is left."""
    orientation_only = problem.rows.orientation_only()
    cell, best, iterations = problem.start, None, 0
    for _ in range(_MAX_ROUNDS):
        turned = cell
        if problem.rows.has_orientation and len(problem.angular):
            stage = problem.fit(cell, problem.angular, orientation_only, _STAGE_ITERATIONS)
            turned = problem.moved(cell, problem.angular, stage)
            iterations += stage.iterations
        minimum: Minimum = problem.fit(turned, problem.free, problem.rows, MAX_ITERATIONS)
        iterations += minimum.iterations
        fallen = float("inf") if best is None else best.cost - minimum.cost
        if best is None or fallen > 0:
            cell, best = problem.moved(turned, problem.free, minimum), minimum
        if fallen <= _COST_TOLERANCE * best.cost:
            break
    assert best is not None
    return Fit(cell, best, iterations, best.converged)
