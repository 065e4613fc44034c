"""From a bundle to the identified robot."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.bundle import Bundle, RejectedRow
from robocal.identification.adequacy import judge
from robocal.identification.cell_model import CellModel
from robocal.identification.drift_errors import common_information
from robocal.identification.observations import Observations
from robocal.identification.outliers import named_outliers, score_rows
from robocal.identification.prepared import Prepared, prepare
from robocal.identification.priors import Choices, prior_centre
from robocal.identification.problem import residuals
from robocal.identification.result import Identification, ResidualSummary
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import (
    Solution,
    covariance_of,
    frames_alone,
    solve_without_outliers,
)
from robocal.identification.strategies import STRATEGIES

DEFAULT_STRATEGY = "simultaneous"


def identify(
    bundle: Bundle, strategy: str = DEFAULT_STRATEGY, choices: Choices | None = None
) -> Identification:
    """Identify geometry, base, tool and nests from the fit rows of a bundle.

    Parameters
    ----------
    bundle
        Full poses, positions, lengths from an anchor, or any mixture.
    strategy
        One of `strategies.STRATEGIES`.
    choices
        Parameters to fix, to free, or with priors of their own; the bundle's if None.

    Raises
    ------
    BadInput
        If the rows hold fewer numbers than there are parameters, or a name is unknown.
    """
    if strategy not in STRATEGIES:
        known = ", ".join(STRATEGIES)
        raise BadInput(f"strategy '{strategy}'", f"is not known; known are {known}")
    ready = prepare(bundle, bundle.choices if choices is None else choices)
    rows = ready.observe(bundle, ~ready.rows.held_out)
    how = STRATEGIES[strategy]
    before = frames_alone(ready.start, rows, ready.choices, identify_simultaneously)
    centre = prior_centre(before.cell, ready.start, ready.choices)
    solution = solve_without_outliers(before.cell, rows, ready.choices, how, centre)
    held_out = ready.observe(bundle, ready.rows.held_out) if ready.rows.held_out.any() else None
    return _result(bundle, ready, strategy, solution, rows, held_out, before.cell)


def summarise(cell: CellModel, rows: Observations) -> ResidualSummary:
    """Size of the residuals over some rows."""
    found = residuals(cell, rows)
    size = np.linalg.norm(found.position, axis=0)
    located = rows.position_weight > 0
    if not located.any():
        size, located = np.abs(found.distance), rows.distance_weight > 0
    size = size[located]
    turned = rows.orientation_weight > 0
    angle = np.linalg.norm(found.orientation[:, turned], axis=0)
    return ResidualSummary(
        rows=len(rows),
        position_rms=float(np.sqrt(np.mean(size**2))) if len(size) else 0.0,
        position_mean=float(size.mean()) if len(size) else 0.0,
        position_max=float(size.max(initial=0.0)),
        orientation_rms=float(np.sqrt(np.mean(angle**2))) if turned.any() else None,
    )


def _result(
    bundle: Bundle,
    ready: Prepared,
    strategy: str,
    solution: Solution,
    rows: Observations,
    held_out: Observations | None,
    before: CellModel,
) -> Identification:
    fit, problem = solution.fit, solution.problem
    cell, reasons = fit.cell, solution.redundancy.reasons
    lines = ready.rows.lines[~ready.rows.held_out]
    covariance, nu = solution.covariance, solution.nu
    shared = _shared_error(ready, solution)
    if shared is not None:
        nu -= float(np.sum(covariance * shared))
        covariance = covariance + covariance @ shared @ covariance
    rejected = named_outliers(lines, solution.scores, ~solution.used)
    suspect: tuple[RejectedRow, ...] = ()
    if held_out is not None:
        took_part = np.zeros(len(held_out), dtype=bool)
        scale = solution.scores.scale
        scores = score_rows(cell, held_out, problem.free, covariance_of(fit), took_part, scale)
        suspect = named_outliers(ready.rows.lines[ready.rows.held_out], scores, scores.outlying)
    return Identification(
        nominal=bundle.robot.geometry,
        cell=replace(cell, geometry=cell.geometry.with_frames_as_origin()),
        fitted=cell,
        free=problem.free,
        covariance=covariance,
        reasons=reasons,
        combinations=solution.redundancy.combinations,
        choices=ready.choices.without_free(reasons),
        unmet={name: reasons[name] for name in sorted(reasons) if ready.choices.speaks_of(name)},
        rank=solution.redundancy.rank,
        condition=solution.redundancy.condition,
        strategy=strategy,
        iterations=fit.iterations,
        converged=fit.converged,
        adequacy=judge(solution.chi_square, nu, rows.n_scalars / len(rows)),
        fit=summarise(cell, rows.choose(solution.used)),
        held_out=None if held_out is None else summarise(cell, held_out),
        before=summarise(before, rows if held_out is None else held_out),
        rejected=(*bundle.rejected, *rejected),
        suspect=suspect,
        drift=ready.drift,
        bundle_sha256=bundle.sha256,
        tool_known=bundle.tool_known,
        tool_rotation_known=bundle.tool_rotation_known,
        base_rotation_known=bundle.base_rotation_known,
    )


def _shared_error(ready: Prepared, solution: Solution) -> Float[Array, "free free"] | None:
    """What the station's drift leaves in all rows alike; None where no drift was removed."""
    used = ~ready.rows.held_out
    used[used] = solution.used
    errors = ready.drift_errors(used)
    if errors is None:
        return None
    problem = solution.problem
    return common_information(solution.fit.cell, problem.rows, problem.free, errors)
