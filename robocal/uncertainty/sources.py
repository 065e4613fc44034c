r"""The sources of uncertainty of an identification, each with what it does to the parameters.

The estimate moves by :math:`C J^T W e` when the readings are off by e, with C the covariance of
the fit, J the Jacobian and W the weights; an error of covariance S therefore adds
:math:`C J^T W S W J C`, and the prior of precision P adds :math:`C P C`. Where the errors are those
that the weights stand for, all parts sum up to C.

References
----------
.. [1] JCGM 102:2011, 6.2 (law of propagation for several outputs).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.errors import NoAnswer
from robocal.identification.drift_errors import drift_information
from robocal.identification.priors import WIDE_ANGLE, WIDE_LENGTH
from robocal.identification.problem import whitened_blocks
from robocal.uncertainty.budget import ReadingsBy
from robocal.uncertainty.fitted_rows import FittedRows
from robocal.uncertainty.repeats import Repeats

TEMPERATURE = "temperature of the robot"
OPEN_FRAMES = "frames, where the readings leave them open"
"""Moves of base, tool and nests that the readings hardly tell apart: metres, along which the target
stays where it is"""


class Evaluated(StrEnum):
    """How a standard uncertainty was found (GUM, 2.3.2 and 2.3.3)."""

    type_a = "A"
    type_b = "B"


@dataclass(frozen=True)
class Source:
    """One line of the budget."""

    name: str
    evaluated: Evaluated
    stated: str
    """The figure that it starts from, for people."""
    nu: float
    """Degrees of freedom of that figure."""
    covariance: Float[Array, "parameter parameter"]
    """What it alone does to the parameters of the cell [m, rad]."""


def sources_of(fit: FittedRows, repeats: Repeats) -> tuple[Source, ...]:
    """All sources that are not zero.

    Raises
    ------
    NoAnswer
        If the campaign wants the scatter from repeats, of which there are none.
    """
    if fit.bundle.budget.readings is ReadingsBy.repeats:
        scatter = tuple(_from_repeats(fit, repeats))
    else:
        scatter = tuple(_declared(fit))
    found = (*scatter, *_shared(fit), *_prior(fit))
    return tuple(source for source in found if source.covariance.any())


def total_covariance(sources: tuple[Source, ...]) -> Float[Array, "parameter parameter"]:
    """Of all parameters, all sources together."""
    return np.asarray(sum(source.covariance for source in sources))


def _declared(fit: FittedRows) -> Iterator[Source]:
    noise = fit.bundle.instrument
    ranges = np.linalg.norm(fit.rows.position, axis=0)
    lengths = fit.rows.distance
    nothing = np.zeros(len(fit.rows))
    everywhere = np.ones(len(fit.rows))
    for name, figure, std_position, std_distance, std_orientation in (
        ("instrument, fixed part", f"{noise.fixed * 1e3:g} mm",
         noise.fixed * everywhere, noise.fixed * everywhere, nothing),
        ("instrument, part growing with range", f"{noise.per_range * 1e6:g} ppm",
         noise.per_range * ranges, noise.per_range * lengths, nothing),
        ("instrument, orientation", f"{noise.orientation * 1e3:g} mrad",
         nothing, nothing, noise.orientation * everywhere),
        ("robot repeatability, position", f"{noise.repeatability * 1e3:g} mm",
         noise.repeatability * everywhere, noise.repeatability * everywhere, nothing),
        ("robot repeatability, orientation", f"{noise.orientation_repeatability * 1e3:g} mrad",
         nothing, nothing, noise.orientation_repeatability * everywhere),
    ):  # fmt: skip
        inner = _information(fit, std_position, std_orientation, std_distance)
        yield Source(name, Evaluated.type_b, figure, np.inf, fit.spread(inner))


def _information(
    fit: FittedRows,
    std_position: Float[Array, "row"],
    std_orientation: Float[Array, "row"],
    std_distance: Float[Array, "row"],
) -> Float[Array, "free free"]:
    """J' W S W J for errors that are independent from reading to reading."""
    rows = fit.rows
    seen = replace(
        rows,
        position_weight=rows.position_weight**2 * std_position,
        orientation_weight=rows.orientation_weight**2 * std_orientation,
        distance_weight=rows.distance_weight**2 * std_distance,
    )
    if not (seen.has_position or seen.has_orientation or seen.has_distance):
        return np.zeros((len(fit.free), len(fit.free)))
    return fit.equations(seen).hessian


def _from_repeats(fit: FittedRows, repeats: Repeats) -> Iterator[Source]:
    noise = fit.bundle.instrument
    ranges = np.linalg.norm(fit.rows.position, axis=0)
    nothing = np.zeros(len(fit.rows))
    constant = noise.fixed**2 + noise.repeatability**2
    std = np.sqrt(constant + (noise.per_range * ranges) ** 2)
    std_distance = np.sqrt(constant + (noise.per_range * fit.rows.distance) ** 2)
    turning = np.full(len(fit.rows), noise.orientation_std())
    for kind, scatter, stds in (
        ("position", repeats.position, (std, nothing, std_distance)),
        ("orientation", repeats.orientation, (nothing, turning, nothing)),
    ):
        there = fit.rows.has_position if kind == "position" else fit.rows.has_orientation
        if scatter is None:
            if there:
                raise NoAnswer(
                    "campaign.yaml field 'budget.readings' asks for the scatter of repeats, but no "
                    f"{kind} was measured twice at the same pose; measure repeats or write declared"
                )
            continue
        unit = "mm" if kind == "position" else "mrad"
        inner = scatter.ratio * _information(fit, *stds)
        yield Source(
            f"readings, {kind}, from repeats",
            Evaluated.type_a,
            f"{scatter.std * 1e3:.4g} {unit}",
            float(scatter.nu),
            fit.spread(inner),
        )


def _shared(fit: FittedRows) -> Iterator[Source]:
    """Errors that several readings have in common."""
    budget = fit.bundle.budget
    yield Source(
        "target in its nest", Evaluated.type_b, f"{budget.target * 1e3:g} mm", np.inf,
        fit.spread(_target_information(fit)),
    )  # fmt: skip
    along = _scale_direction(fit) * budget.scale
    yield Source(
        "instrument, length scale", Evaluated.type_b, f"{budget.scale * 1e6:g} ppm", np.inf,
        fit.spread(np.outer(along, along)),
    )  # fmt: skip
    if fit.drift_errors is not None:
        left = np.sqrt(np.mean((fit.drift_errors[:, :3] ** 2).sum(axis=(1, 2))) / 3.0)
        yield Source(
            "station drift, as the fixed nests show it", Evaluated.type_b,
            f"{left * 1e3:.2g} mm", np.inf,
            fit.spread(drift_information(fit.cell, fit.rows, fit.free, fit.drift_errors)),
        )  # fmt: skip
    growth = expansion_direction(fit) * budget.expansion * budget.temperature
    yield Source(
        TEMPERATURE, Evaluated.type_b, f"{budget.temperature:g} degC", np.inf,
        np.outer(growth, growth),
    )  # fmt: skip


def _target_information(fit: FittedRows) -> Float[Array, "free free"]:
    """J' W S W J for errors of position that repeats of one pose have in common."""
    rows = fit.rows
    nothing = np.zeros(len(rows))
    seen = replace(
        rows,
        position_weight=rows.position_weight**2 * fit.bundle.budget.target,
        orientation_weight=nothing,
        distance_weight=nothing,
    )
    inner = np.zeros((len(fit.free), len(fit.free)))
    if not seen.has_position:
        return inner
    group = fit.measured.visit
    common = np.zeros((group.max() + 1, len(fit.free), 3))
    for block in whitened_blocks(fit.cell, seen, fit.free):
        J = block.J.reshape(len(fit.free), 3, len(block.rows))
        np.add.at(common, group[block.rows], J.transpose(2, 0, 1))
    return np.asarray(np.einsum("gfc,ghc->fh", common, common, optimize=True))


def _scale_direction(fit: FittedRows) -> Float[Array, "free"]:
    """J' W y: what a relative error of all lengths would pull on the parameters."""
    rows = fit.rows
    twice = replace(rows, position=2.0 * rows.position, distance=2.0 * rows.distance)
    return np.asarray(fit.equations(rows).gradient - fit.equations(twice).gradient)


def expansion_direction(fit: FittedRows) -> Float[Array, "parameter"]:
    """Change of every parameter for a relative growth of the robot and its tool [m]."""
    geometry = fit.cell.geometry
    change = np.zeros(len(fit.cell.names))
    n = 5 * geometry.n_joints
    links = change[:n].reshape(-1, 5)
    links[:, 1:3] = geometry.links[:, 1:3]
    tool, flange = geometry.tool_frame, fit.cell.flange
    change[n + 6 : n + 9] = tool[:3, :3].T @ tool[:3, 3]
    places = slice(geometry.n_parameters, geometry.n_parameters + fit.cell.places.size)
    change[places] = (fit.cell.places + flange[:3, :3].T @ flange[:3, 3]).ravel()
    return change


def _prior(fit: FittedRows) -> Iterator[Source]:
    wide = is_wide(fit)
    for name, stated, those in (
        ("nominal geometry (prior)", "link lengths and angles", ~wide),
        (OPEN_FRAMES, "no statement", wide),
    ):
        inner = np.diag(np.where(those, fit.prior_precision, 0.0))
        yield Source(name, Evaluated.type_b, stated, np.inf, fit.spread(inner))


def is_wide(fit: FittedRows) -> Bool[Array, "free"]:
    """Free parameters whose prior is no statement: frames, nests, anchor."""
    widest = np.where(fit.cell.is_angle[fit.free], WIDE_ANGLE, WIDE_LENGTH)
    return np.asarray(fit.prior_precision * widest**2 <= 1.0 + 1e-9)
