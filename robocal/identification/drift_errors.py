r"""What the noise of the fixed nests leaves in the rows from which the station's drift was taken.

The nests are read with noise, so the drift found from them is off, and all rows read between two
visits are off alike. With the drift's error linear in independent unit noise z, a row's pose is off
by :math:`D_k z`. The rows' weights count its variance :math:`v_k`, the covariance of the fit what
the rows have in common besides:

.. math:: C + C K C, \quad K = G G^T - \sum_k v_k J_k^T W_k^2 J_k, \quad G = \sum_k J_k^T W_k D_k.

What the rows have in common the fit takes up in part, so residuals are smaller than the weights
say: of the sum of their squares :math:`\operatorname{tr}(C K)` is missing.

References
----------
.. [1] JCGM 102:2011, 6.2 (law of propagation for several outputs).
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from numpy import ndarray as Array

from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.problem import whitened_blocks
from robocal.identification.station_drift import StationDrift
from robocal.measurements import MeasurementSet

_COMPONENTS = {"position": slice(0, 3), "orientation": slice(3, 6)}


def drift_errors(drift: StationDrift, rows: MeasurementSet) -> Float[Array, "row 6 noise"]:
    """Error of position [m] and orientation [rad] of each row for a unit of each noise."""
    visit = np.interp(drift.clock(rows), drift.time, np.arange(len(drift.time)))
    before = np.minimum(visit.astype(int), len(drift.time) - 2)
    share = (visit - before)[:, None, None]
    motion = (1.0 - share) * drift.factor[before] + share * drift.factor[before + 1]
    arm = (rows.position - drift.centre)[:, None, :]
    turn = np.moveaxis(motion[:, 3:], 1, 2)
    shift = motion[:, :3] + np.moveaxis(np.cross(turn, np.nan_to_num(arm)), 2, 1)
    return -np.concatenate([shift, motion[:, 3:]], axis=1)


def widened(rows: Observations, errors: Float[Array, "row 6 noise"]) -> Observations:
    """The same rows, weighted by what the drift leaves in them too."""
    variance = {
        part: (errors[:, of] ** 2).sum(axis=(1, 2)) / 3.0 for part, of in _COMPONENTS.items()
    }
    return replace(
        rows,
        position_weight=_widened(rows.position_weight, variance["position"]),
        orientation_weight=_widened(rows.orientation_weight, variance["orientation"]),
    )


def _widened(weight: Float[Array, "row"], variance: Float[Array, "row"]) -> Float[Array, "row"]:
    return np.asarray(weight / np.sqrt(1.0 + weight**2 * variance))


def drift_information(
    cell: CellModel,
    rows: Observations,
    free: Int[Array, "free"],
    errors: Float[Array, "row 6 noise"],
) -> Float[Array, "free free"]:
    """J' W S W J of the errors that the rows have in common."""
    G = np.zeros((len(free), errors.shape[2]))
    for block in whitened_blocks(cell, rows, free):
        J = block.J.reshape(len(free), block.components, -1)
        for part, components in block.parts:
            if part not in _COMPONENTS:
                continue
            own = errors[block.rows, _COMPONENTS[part]]
            whitened = own * _weight(rows, part)[block.rows, None, None]
            G += np.einsum("fcm,mck->fk", J[:, components], whitened, optimize=True)
    return np.asarray(G @ G.T)


def common_information(
    cell: CellModel,
    rows: Observations,
    free: Int[Array, "free"],
    errors: Float[Array, "row 6 noise"],
) -> Float[Array, "free free"]:
    """The same less what the weights of `widened` rows count already, row by row."""
    alone = np.zeros((len(free), len(free)))
    for block in whitened_blocks(cell, rows, free):
        J = block.J.reshape(len(free), block.components, -1)
        for part, components in block.parts:
            if part not in _COMPONENTS:
                continue
            variance = (errors[block.rows, _COMPONENTS[part]] ** 2).sum(axis=(1, 2)) / 3.0
            scaled = J[:, components] * (variance * _weight(rows, part)[block.rows] ** 2)
            alone += np.einsum("fcm,gcm->fg", J[:, components], scaled, optimize=True)
    return drift_information(cell, rows, free, errors) - alone


def _weight(rows: Observations, part: str) -> Float[Array, "row"]:
    return rows.position_weight if part == "position" else rows.orientation_weight
