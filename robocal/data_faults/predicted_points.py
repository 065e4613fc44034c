"""Where the joints of any row would put the target of any other, in the robot's own frame."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.data_faults.campaign_view import targets_on_tool
from robocal.data_faults.frame_fits import RigidFit
from robocal.data_faults.rows import SHIFTS, partners
from robocal.formats.bundle import Bundle
from robocal.identification.frames_start import nominal_flange
from robocal.measurements import MeasurementSet

_VOTERS = 60


@dataclass(frozen=True)
class PredictedPoints:
    """Flange poses and measured points of every row of a campaign."""

    R: Float[Array, "row 3 3"]
    P: Float[Array, "row 3"]
    measured: Float[Array, "row 3"]
    """Carried into the robot's frame; NaN where the place of the target is not known."""
    nest: Float[Array, "row 3"]
    """Point in the flange that belongs to each measurement [m]."""

    @property
    def seen(self) -> Bool[Array, "row"]:
        """Rows that can be judged."""
        return np.asarray(np.isfinite(self.measured[:, 0]))

    def distance(
        self, measured: Int[Array, "some"], joints: Int[Array, "some"]
    ) -> Float[Array, "some"]:
        """From measurements to the points of the joints of other rows [m]."""
        away = self.nest[measured] - self.in_flange(measured, joints)
        return np.asarray(np.linalg.norm(away, axis=1))

    def in_flange(
        self, measured: Int[Array, "some"], joints: Int[Array, "some"]
    ) -> Float[Array, "some 3"]:
        """Measurements as the flange of other rows sees them [m]."""
        away = self.measured[measured] - self.P[joints]
        return np.asarray((away[:, None] @ self.R[joints])[:, 0])


def predict_points(
    bundle: Bundle,
    rows: MeasurementSet,
    order: Int[Array, "row"],
    fit: RigidFit,
    tolerance: float,
) -> PredictedPoints:
    """Points of the targets on the tool, each where the fit or most of its rows put it.

    Parameters
    ----------
    bundle
        Where the rows come from.
    rows
        They, with all slips of columns mended.
    order
        Number of each row in the file.
    fit
        Of the targets that have most rows.
    tolerance
        Distance that a right row may have [m].
    """
    T = nominal_flange(bundle.robot.geometry, rows.joints)
    measured = rows.position @ fit.rotation.T - fit.offset
    points = PredictedPoints(T[:, :3, :3], T[:, :3, 3], measured, np.full_like(measured, np.nan))
    names = np.array(rows.target)
    on_tool = targets_on_tool(bundle)
    for number, name in enumerate(on_tool):
        chosen = np.flatnonzero((names == name) & points.seen)
        if number < len(fit.places):
            points.nest[chosen] = fit.places[number]
        own = points.distance(chosen, chosen)
        if not np.count_nonzero(own <= tolerance) > len(own) / 2:
            points.nest[chosen] = _voted_place(points, chosen, order, tolerance)
    measured[~np.isin(names, on_tool)] = np.nan
    return points


def _voted_place(
    points: PredictedPoints,
    chosen: Int[Array, "some"],
    order: Int[Array, "row"],
    tolerance: float,
) -> Float[Array, "3"]:
    """Where most rows put their target, each beside its own joints or those of rows near by."""
    voters = chosen[np.linspace(0, len(chosen) - 1, min(len(chosen), _VOTERS)).astype(int)]
    votes = []
    for shift in SHIFTS:
        source = partners(order, np.full(len(order), shift))[voters]
        votes.append(points.in_flange(voters[source >= 0], source[source >= 0]))
    place = np.concatenate(votes)
    near = np.linalg.norm(place[:, None] - place, axis=2) <= tolerance
    return np.asarray(np.median(place[near[np.argmax(near.sum(axis=1))]], axis=0))
