"""Where the joints of any row would put the target of any other, in the robot's own frame."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy import ndarray as Array

from robocal.data_faults.frame_fits import RigidFit
from robocal.formats.bundle import Bundle
from robocal.identification.frames_start import nominal_flange
from robocal.measurements import MeasurementSet


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
        flange = (self.R[joints] @ self.nest[measured, :, None])[:, :, 0]
        away = self.measured[measured] - self.P[joints] - flange
        return np.asarray(np.linalg.norm(away, axis=1))


def predict_points(
    bundle: Bundle, rows: MeasurementSet, main: Bool[Array, "row"], fit: RigidFit
) -> PredictedPoints:
    """Points of the main target by its fit; other targets on the tool by their median place."""
    T = nominal_flange(bundle.robot.geometry, rows.joints)
    R, P = T[:, :3, :3], T[:, :3, 3]
    measured = rows.position @ fit.rotation.T - fit.offset
    nest = np.broadcast_to(fit.tool, measured.shape).copy()
    names = np.array(rows.target)
    located = np.isfinite(rows.position[:, 0])
    for name in {*rows.target} - {str(names[np.argmax(main)])}:
        chosen = (names == name) & located
        if bundle.targets[name].fixed if name in bundle.targets else False:
            measured[names == name] = np.nan
        elif chosen.any():
            away = (measured - P)[chosen, None]
            nest[chosen] = np.median((away @ R[chosen])[:, 0], axis=0)
    return PredictedPoints(R, P, measured, nest)
