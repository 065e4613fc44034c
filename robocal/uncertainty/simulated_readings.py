"""Readings that the instrument would take of given cells, with errors from every stated source."""

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.instrument import InstrumentNoise
from robocal.uncertainty.budget import Budget
from robocal.uncertainty.many_cells import draws_at_place, many_targets
from robocal.uncertainty.many_fits import Readings


def simulate_readings(
    cell: CellModel,
    truths: Float[Array, "parameter draw"],
    rows: Observations,
    visit: Int[Array, "row"],
    noise: InstrumentNoise,
    budget: Budget,
    rng: np.random.Generator,
) -> Readings:
    """One reading of every row for every draw.

    Parameters
    ----------
    cell
        Constant frames.
    truths
        True parameters behind each draw [m, rad].
    rows
        Joints and places; where their weights are zero nothing is read.
    visit
        Rows with the same number share the error of the target.
    noise, budget
        What errors are drawn.
    """
    clean = clean_readings(cell, truths, rows)
    shape = clean.position.shape
    ranges = np.linalg.norm(clean.position, axis=0)
    scale = 1.0 + budget.scale * rng.normal(size=(shape[1], 1))
    std = np.hypot(np.hypot(noise.fixed, noise.repeatability), noise.per_range * ranges)
    target = budget.target * rng.normal(size=(3, shape[1], visit.max() + 1))[:, :, visit]
    position = scale * clean.position + std * rng.normal(size=shape) + target
    turns = noise.orientation_std() * rng.normal(size=shape)
    std_length = noise.distance_std(clean.distance.ravel()).reshape(clean.distance.shape)
    distance = scale * clean.distance + std_length * rng.normal(size=shape[1:])
    return Readings(
        position * (rows.position_weight > 0),
        turn_axes(clean.axes, turns),
        distance * (rows.distance_weight > 0),
    )


def clean_readings(
    cell: CellModel, truths: Float[Array, "parameter draw"], rows: Observations
) -> Readings:
    """What would be read without any error."""
    n_draws, n_rows = truths.shape[1], len(rows)
    position = np.zeros((3, n_draws, n_rows))
    axes = np.zeros((3, 3, n_draws, n_rows))
    distance = np.zeros((n_draws, n_rows))
    for place, index, group in rows.by_place:
        model, mine = draws_at_place(cell, truths, place)
        target = many_targets(model, mine, group.joints).target
        shape = (3, n_draws, len(group))
        position[:, :, index] = target.p.reshape(shape)
        for axis, direction in enumerate((target.x, target.y, target.z)):
            axes[:, axis, :, index] = np.moveaxis(direction.reshape(shape), 2, 0)
        if cell.anchor is not None:
            away = target.p.reshape(shape) - truths[cell.anchor_columns][:, :, None]
            distance[:, index] = np.linalg.norm(away, axis=0)
    return Readings(position, axes, distance)


def turn_axes(
    axes: Float[Array, "3 3 draw row"], turns: Float[Array, "3 draw row"]
) -> Float[Array, "3 3 draw row"]:
    """Turn every frame by a rotation vector in the measuring frame (Rodrigues' formula)."""
    angle = np.sqrt((turns**2).sum(axis=0))
    sine = np.sinc(angle / np.pi)
    versine = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    turned = np.empty_like(axes)
    for axis in range(3):
        once = np.cross(turns, axes[:, axis], axis=0)
        turned[:, axis] = axes[:, axis] + sine * once + versine * np.cross(turns, once, axis=0)
    return turned
