"""Cross identification: orientation rows for the angles, then all rows for everything, in turn.

Steps S31 to S33 of the patent CN117067221B: S31 fits the angular parameters to the orientation
errors alone, S32 fits all parameters to all errors from there, S33 repeats until the cost no longer
falls.
"""

from robocal.identification.least_squares import MAX_ITERATIONS
from robocal.identification.strategy import Fit, Problem, angular_parameters

_STAGE_ITERATIONS = 20
_MAX_ROUNDS = 20
_COST_TOLERANCE = 1e-9
"""Stop when a round lowers the cost by less than this share; [1]"""


def identify_crosswise(problem: Problem) -> Fit:
    """Alternate between the two stages; without orientation rows only the second is left."""
    angular = angular_parameters(problem)
    orientation_only = problem.rows.without_position()
    model, iterations, cost = problem.start, 0, float("inf")
    for _ in range(_MAX_ROUNDS):
        if problem.rows.has_orientation and len(angular):
            stage = problem.fit(model, angular, orientation_only, _STAGE_ITERATIONS)
            turned = problem.moved(model, angular, stage)
            iterations += stage.iterations
        else:
            turned = model
        minimum = problem.fit(turned, problem.free, problem.rows, MAX_ITERATIONS)
        iterations += minimum.iterations
        if minimum.equations.cost < cost:
            model = problem.moved(turned, problem.free, minimum)
        fallen = cost - minimum.equations.cost
        if fallen <= _COST_TOLERANCE * minimum.equations.cost:
            break
        cost = minimum.equations.cost
    return Fit(model, minimum, iterations, minimum.converged)
