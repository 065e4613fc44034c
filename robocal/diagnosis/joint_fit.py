"""Geometry and effects fitted together, with one covariance.

Gauss-Newton on the nonlinear residual. The Jacobian is that of the robot without the effects, which
are a thousandth of it: the minimum it leads to is off by a thousandth of a standard deviation.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Instance
from robocal.diagnosis.evidence import noise_scale
from robocal.diagnosis.extended import FittedEffect, moves_of, predict_at
from robocal.diagnosis.linearised import Linearised, linearise
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.problem import rotation_residual
from robocal.identification.solve import scaled_inverse
from robocal.identification.strategy import Problem

_MAX_STEPS = 6
_STEP_TOLERANCE = 1e-4
"""Largest step of a parameter that counts as none, in its standard uncertainties; [1]"""


@dataclass(frozen=True)
class JointFit:
    """Minimum over geometry and effects.

    Parameters
    ----------
    cell
        Geometry at the minimum, in the frames of the start.
    effects
        With coefficients and their covariance.
    covariance
        Of the free geometric parameters and all coefficients, in this order.
    fit
        Linear algebra at the minimum, effects among the known columns.
    gram
        Information of the data on the same unknowns, in declared noise.
    pull
        What the priors pull at the minimum, unknown by unknown.
    """

    cell: CellModel
    effects: tuple[FittedEffect, ...]
    covariance: Float[Array, "unknown unknown"]
    fit: Linearised
    gram: Float[Array, "unknown unknown"]
    pull: Float[Array, "unknown"]

    @property
    def chi_square(self) -> float:
        """Sum of the squared whitened residuals."""
        return float(self.fit.r @ self.fit.r)

    @property
    def nu(self) -> float:
        """Measured scalars less what the fit took out of them."""
        return self.fit.n_measured - float((self.fit.basis**2).sum())

    @cached_property
    def scale(self) -> float:
        """Noise that candidates are judged by, in declared ones, see `noise_scale`."""
        return noise_scale(self.chi_square, self.nu)

    def columns_without(self, *positions: int) -> Bool[Array, "unknown"]:
        """The unknowns that are left when some effects are taken out."""
        sizes = [len(fitted.instance.coefficients) for fitted in self.effects]
        owner = np.repeat(np.arange(len(sizes)), sizes)
        geometry: Bool[Array, "free"] = np.ones(len(self.fit.free), dtype=bool)
        return np.concatenate([geometry, ~np.isin(owner, positions)])

    def evidence_of_effects(self) -> Float[Array, "effect"]:
        r"""Log Bayes factor of each effect given all the others.

        By the density ratio of Savage and Dickey: prior over posterior density of its coefficients
        at zero, in units of the noise that candidates are judged by.
        """
        weight = self.scale**-2.0
        precision = self.fit.precision
        covariance = scaled_inverse(weight * self.gram + np.diag(precision))
        moved = covariance @ (self.pull * (weight - 1.0))
        n_free = len(self.fit.free)
        values = np.concatenate([f.values for f in self.effects] or [np.zeros(0)])
        values = values + moved[n_free:]
        found, first = [], 0
        for fitted in self.effects:
            part = slice(first, first + len(fitted.instance.coefficients))
            C = covariance[n_free:, n_free:][part, part]
            c = values[part]
            prior = 2.0 * np.log(fitted.instance.prior_std).sum()
            fit = float(c @ np.linalg.solve(C, c))
            found.append(0.5 * (fit + np.linalg.slogdet(C)[1] - prior))
            first = part.stop
        return np.array(found)

    def without(self, fit: Linearised, *positions: int) -> Linearised:
        """The linear fit as it would stand without some effects, the rest refitted.

        Parameters
        ----------
        fit
            `judged`, or some rows of it.
        positions
            Of the effects.
        """
        kept = self.columns_without(*positions)
        extra = kept[len(fit.free) :]
        values = np.concatenate([fitted.values for fitted in self.effects])
        rest = replace(fit, more=fit.more[:, extra], more_precision=fit.more_precision[extra])
        r = fit.r + fit.more[:, ~extra] @ values[~extra]
        return replace(rest, r=rest.refitted(r, self.pull[kept]))

    def refitted_without(self, *positions: int) -> tuple[CellModel, tuple[FittedEffect, ...]]:
        """Geometry and effects as they would be without some of them, to first order."""
        n_free, kept = len(self.fit.free), self.columns_without(*positions)
        values = np.concatenate([fitted.values for fitted in self.effects])
        hessian = (self.gram + np.diag(self.fit.precision))[np.ix_(kept, kept)]
        freed = self.gram[np.ix_(kept, ~kept)] @ values[~kept[n_free:]]
        moved = np.zeros(len(kept))
        moved[kept] = scaled_inverse(hessian) @ freed
        vector = self.cell.vector
        vector[self.fit.free] += moved[:n_free]
        instances = tuple(fitted.instance for fitted in self.effects)
        C = self.covariance[n_free:, n_free:]
        effects = _fitted(instances, values + moved[n_free:], C)
        rest = tuple(f for k, f in enumerate(effects) if k not in positions)
        return self.cell.with_vector(vector), rest

    @cached_property
    def judged(self) -> Linearised:
        """Linear algebra in units of that noise."""
        return self.fit.in_units_of(self.scale)


def fit_jointly(
    problem: Problem,
    start: CellModel,
    rows: Circumstances,
    instances: tuple[Instance, ...],
    begun: tuple[FittedEffect, ...] = (),
) -> JointFit:
    """Fit geometry and the given effects.

    Parameters
    ----------
    problem
        Rows, free parameters and priors of the geometric fit.
    start
        Geometry to start from.
    rows
        Circumstances of the same rows.
    instances
        Effects to fit.
    begun
        Coefficients to start from, where an instance was fitted before.
    """
    base = linearise(start, problem.rows, problem.free, problem.prior_precision[problem.free])
    columns, precision = effect_columns(base, rows, instances)
    fit = replace(base, more=columns, more_precision=precision)
    known = {fitted.instance: fitted.values for fitted in begun}
    coefficients = np.concatenate(
        [known.get(i, np.zeros(len(i.coefficients))) for i in instances] or [np.zeros(0)]
    )
    A = fit.known
    gram = A.T @ A
    covariance = scaled_inverse(gram + np.diag(fit.precision))
    std = np.sqrt(np.diag(covariance))
    n_free = len(problem.free)
    x = np.concatenate([start.vector[problem.free], coefficients])
    centre = np.concatenate([problem.prior_mean[problem.free], np.zeros(len(coefficients))])
    for _ in range(_MAX_STEPS):
        cell = _with_free(start, problem, x[:n_free])
        effects = _fitted(instances, x[n_free:], covariance[n_free:, n_free:])
        r = whitened_residual(cell, problem.rows, rows, effects)
        step = covariance @ (A.T @ r - fit.precision * (x - centre))
        x = x + step
        if (np.abs(step) < _STEP_TOLERANCE * std).all():
            break
    cell = _with_free(start, problem, x[:n_free])
    effects = _fitted(instances, x[n_free:], covariance[n_free:, n_free:])
    r = whitened_residual(cell, problem.rows, rows, effects)
    pull = fit.precision * (x - centre)
    return JointFit(cell, effects, covariance, replace(fit, r=r), gram, pull)


def effect_columns(
    fit: Linearised, rows: Circumstances, instances: tuple[Instance, ...]
) -> tuple[Float[Array, "scalar extra"], Float[Array, "extra"]]:
    """Columns of effects side by side, and the prior precision of their coefficients."""
    if not instances:
        return np.zeros((len(fit.r), 0)), np.zeros(0)
    columns = [fit.columns(EFFECTS[i.effect].moves(rows, i)) for i in instances]
    return np.concatenate(columns, axis=1), np.concatenate([i.prior_std**-2.0 for i in instances])


def whitened_residual(
    cell: CellModel,
    measured: Observations,
    rows: Circumstances,
    effects: tuple[FittedEffect, ...],
) -> Float[Array, "scalar"]:
    """Residual over the standard deviation, row by row, in the order of `linearise`."""
    moves = moves_of(rows, effects)
    parts: list[Float[Array, "some row"]] = []
    part_rows: list[Float[Array, "some"] | Array] = []
    for place, index, group in measured.by_place:
        here = {parameter: values[index] for parameter, values in moves.items()}
        target = predict_at(cell.at_place(place), group.joints, here)
        if group.has_position:
            parts.append((group.position - target.p) * group.position_weight)
        if group.has_orientation:
            parts.append(rotation_residual(group.axes, target) * group.orientation_weight)
        if group.has_distance and cell.anchor is not None:
            length = np.linalg.norm(target.p - cell.anchor[:, None], axis=0)
            parts.append(((group.distance - length) * group.distance_weight)[None])
        while len(part_rows) < len(parts):
            part_rows.append(np.tile(index, parts[len(part_rows)].shape[0]))
    row = np.concatenate(part_rows)
    return np.concatenate([part.ravel() for part in parts])[np.argsort(row, kind="stable")]


def _with_free(start: CellModel, problem: Problem, values: Array) -> CellModel:
    vector = start.vector
    vector[problem.free] = values
    return start.with_vector(vector)


def _fitted(
    instances: tuple[Instance, ...], values: Array, covariance: Array
) -> tuple[FittedEffect, ...]:
    fitted, first = [], 0
    for instance in instances:
        part = slice(first, first + len(instance.coefficients))
        fitted.append(FittedEffect(instance, values[part], covariance[part, part]))
        first = part.stop
    return tuple(fitted)
