"""An identification together with the rows that it was made of, linearised at its solution."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.formats.bundle import Bundle
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.prepared import prepare
from robocal.identification.priors import prior_std
from robocal.identification.problem import NormalEquations, normal_equations
from robocal.identification.result import Identification
from robocal.measurements import MeasurementSet


@dataclass(frozen=True)
class FittedRows:
    """What the uncertainty of an identification is computed from.

    Parameters
    ----------
    bundle, result
        What was identified from what.
    measured, rows
        The rows that took part, as measured and as weighted.
    prior_precision
        Of the free parameters [1/m2 or 1/rad2].
    """

    bundle: Bundle
    result: Identification
    measured: MeasurementSet
    rows: Observations
    prior_precision: Float[Array, "free"]
    drift_errors: Float[Array, "row 6 noise"] | None
    """What the fixed nests' noise leaves in the rows; None where no drift was removed."""

    @property
    def cell(self) -> CellModel:
        """The identified cell."""
        return self.result.cell

    @property
    def free(self) -> Int[Array, "free"]:
        """Parameters that moved."""
        return self.result.free

    @cached_property
    def covariance(self) -> Float[Array, "free free"]:
        """Of the free parameters, prior included, as the declared noise and the prior leave it."""
        hessian = self.equations(self.rows).hessian + np.diag(self.prior_precision)
        scale = 1.0 / np.sqrt(np.diag(hessian))
        scaled = np.linalg.inv(hessian * np.outer(scale, scale))
        return np.asarray(0.5 * (scaled + scaled.T) * np.outer(scale, scale))

    def equations(self, rows: Observations) -> NormalEquations:
        """Normal equations of any rows with the same joints, at the solution."""
        return normal_equations(self.cell, rows, self.free)

    def spread(self, inner: Float[Array, "free free"]) -> Float[Array, "parameter parameter"]:
        """C M C over all parameters: what errors with information M do to the estimate."""
        n = len(self.cell.names)
        full = np.zeros((n, n))
        # By a root, as rounding leaves negative variances where C is open by metres.
        values, vectors = np.linalg.eigh(inner)
        half = self.covariance @ (vectors * np.sqrt(np.maximum(values, 0.0)))
        full[np.ix_(self.free, self.free)] = half @ half.T
        return full


def fitted_rows(bundle: Bundle, result: Identification) -> FittedRows:
    """Take up an identification again: its rows less the rejected ones, its priors."""
    ready = prepare(bundle, result.choices)
    rejected = [row.line for row in result.rejected]
    used = ~ready.rows.held_out & ~np.isin(ready.rows.lines, rejected)
    std = prior_std(result.cell, ready.choices)[result.free]
    with np.errstate(divide="ignore"):
        precision = np.where(np.isfinite(std), 1.0 / std**2, 0.0)
    return FittedRows(
        bundle,
        result,
        ready.rows.rows(used),
        ready.observe(bundle, used),
        precision,
        ready.drift_errors(used),
    )
