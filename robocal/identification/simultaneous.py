"""All parameters and all rows in one Levenberg-Marquardt run."""

from robocal.identification.least_squares import MAX_ITERATIONS
from robocal.identification.strategy import Fit, Problem


def identify_simultaneously(problem: Problem) -> Fit:
    """Minimise over everything at once."""
    minimum = problem.fit(problem.start, problem.free, problem.rows, MAX_ITERATIONS)
    cell = problem.moved(problem.start, problem.free, minimum)
    return Fit(cell, minimum, minimum.iterations, minimum.converged)
