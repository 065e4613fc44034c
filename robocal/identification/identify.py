"""From a bundle to the identified robot."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.formats.bundle import Bundle
from robocal.frames import frame_from_xyz_ypr
from robocal.identification.frames_start import start_frames
from robocal.identification.problem import (
    Observations,
    observations,
    residuals,
    whitened_jacobian,
)
from robocal.identification.redundancy import Redundancy, find_redundancy
from robocal.identification.result import Identification, ResidualSummary
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.strategies import STRATEGIES
from robocal.identification.strategy import Problem
from robocal.kinematics.model import KinematicModel, parameter_is_angle

PRIOR_LENGTH = 1e-3
"""How far a link length may be off its nominal value, one standard deviation [m]"""
PRIOR_ANGLE = 5e-3
"""The same for a link angle [rad]"""
DEFAULT_STRATEGY = "simultaneous"
_STRUCTURE_ROWS = 400


def identify(bundle: Bundle, strategy: str = DEFAULT_STRATEGY) -> Identification:
    """Identify geometry, base and tool from the fit rows of a bundle.

    Parameters
    ----------
    bundle
        Measured poses or positions.
    strategy
        One of `strategies.STRATEGIES`.

    Raises
    ------
    BadInput
        If the rows hold fewer numbers than there are parameters, or kinds of rows that this
        identification cannot use.
    """
    if strategy not in STRATEGIES:
        known = ", ".join(STRATEGIES)
        raise BadInput(f"strategy '{strategy}'", f"is not known; known are {known}")
    _refuse_other_rows(bundle)
    fit_rows = observations(bundle.measurements.fit_rows, bundle.instrument)
    _refuse_too_few(bundle, fit_rows)
    nominal = bundle.robot.geometry
    start = _start(bundle, fit_rows)
    redundancy = _structure(start, fit_rows)
    free = np.flatnonzero(redundancy.identified | redundancy.weak)
    problem = Problem(start, fit_rows, free, prior_precision(start))
    fit = STRATEGIES[strategy](problem)
    before = identify_simultaneously(
        replace(problem, free=problem.free[problem.free >= 5 * start.n_joints])
    )
    held_out = None
    if bundle.measurements.held_out.any():
        held_out = observations(bundle.measurements.held_out_rows, bundle.instrument)
    return Identification(
        nominal=nominal,
        model=fit.model.with_frames_as_origin(),
        free=problem.free,
        covariance=np.linalg.inv(fit.minimum.hessian),
        reasons=redundancy.reasons,
        fixed=frozenset(),
        rank=redundancy.rank,
        condition=redundancy.condition,
        strategy=strategy,
        iterations=fit.iterations,
        converged=fit.converged,
        fit=summarise(fit.model, fit_rows),
        held_out=None if held_out is None else summarise(fit.model, held_out),
        before=summarise(before.model, fit_rows if held_out is None else held_out),
        rejected=bundle.rejected,
        bundle_sha256=bundle.sha256,
        chi_square=2.0 * fit.minimum.equations.cost,
        nu=fit_rows.n_scalars - redundancy.rank,
    )


def _structure(start: KinematicModel, rows: Observations) -> Redundancy:
    """What the rows can tell apart, judged on some of them that stand for all."""
    few = _evenly(rows, _STRUCTURE_ROWS)
    J = whitened_jacobian(start, few, np.arange(start.n_parameters))
    J *= np.sqrt(len(rows) / len(few))
    with np.errstate(divide="ignore"):
        prior_std = 1.0 / np.sqrt(prior_precision(start))
    return find_redundancy(J, start, np.ones(start.n_parameters, dtype=bool), prior_std)


def prior_precision(model: KinematicModel) -> Float[Array, "parameter"]:
    """Inverse variance of every parameter before any measurement; zero for the two frames."""
    angle = parameter_is_angle(model.n_joints)
    precision = np.where(angle, PRIOR_ANGLE**-2, PRIOR_LENGTH**-2)
    precision[5 * model.n_joints :] = 0.0
    return np.asarray(precision)


def summarise(model: KinematicModel, rows: Observations) -> ResidualSummary:
    """Size of the residuals over some rows."""
    position, orientation = residuals(model, rows)
    distance = np.linalg.norm(position, axis=0)
    turned = rows.orientation_weight > 0
    angle = np.linalg.norm(orientation[:, turned], axis=0)
    return ResidualSummary(
        rows=len(rows),
        position_rms=float(np.sqrt(np.mean(distance**2))),
        position_mean=float(distance.mean()),
        position_max=float(distance.max()),
        orientation_rms=float(np.sqrt(np.mean(angle**2))) if turned.any() else None,
    )


def _start(bundle: Bundle, rows: Observations) -> KinematicModel:
    """Nominal links with both frames at their closed-form start.

    The tool's rotation, which positions do not see, is taken from the campaign's guess.
    """
    frames = start_frames(bundle.robot.geometry, rows)
    tool = frames.tool
    if not rows.has_orientation and bundle.tool_guess is not None:
        tool = tool.copy()
        tool[:3, :3] = frame_from_xyz_ypr(bundle.tool_guess)[:3, :3]
    # The closed form puts the whole flange-to-target transform into the tool.
    flange = bundle.robot.geometry.flange
    return bundle.robot.geometry.with_frames(frames.base, flange @ tool).with_frames_as_origin()


def _evenly(rows: Observations, most: int) -> Observations:
    """At most so many rows, evenly spread."""
    chosen: Bool[Array, "row"] = np.zeros(len(rows), dtype=bool)
    chosen[np.unique(np.linspace(0, len(rows) - 1, most).astype(int))] = True
    return rows.choose(chosen)


def _refuse_other_rows(bundle: Bundle) -> None:
    rows = bundle.measurements
    for row in np.flatnonzero(np.isfinite(rows.distance)):
        raise BadInput(
            f"measurements.csv line {rows.lines[row]}",
            "distances cannot be identified from yet; leave distance_mm empty",
        )
    for line, target in zip(rows.lines, rows.target, strict=True):
        if target:
            raise BadInput(
                f"measurements.csv line {line}",
                f"target '{target}': several targets cannot be identified from yet",
            )
    if not len(rows.fit_rows):
        raise BadInput("measurements.csv", "every row is held out; none is left to fit")


def _refuse_too_few(bundle: Bundle, rows: Observations) -> None:
    wanted = _wanted(bundle, rows)
    if rows.n_scalars < wanted:
        least = -(-wanted * len(rows) // rows.n_scalars)
        raise BadInput(
            f"measurements.csv lines {bundle.measurements.lines[0]} to "
            f"{bundle.measurements.lines[-1]}",
            f"{len(rows)} rows to fit give {rows.n_scalars} numbers for {wanted} parameters; "
            f"measure at least {least} poses besides those held out",
        )


def _wanted(bundle: Bundle, rows: Observations) -> int:
    """Parameters that good data determine: 4 a revolute joint, 2 a prismatic one, 6 more."""
    geometry = bundle.robot.geometry
    prismatic = int(np.count_nonzero(geometry.prismatic))
    full = 4 * (geometry.n_joints - prismatic) + 2 * prismatic + 6
    return full if rows.has_orientation else full - 3
