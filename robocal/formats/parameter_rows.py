"""Link parameters of a calibrated robot beside the nominal ones, as in identification.json."""

import numpy as np

from robocal.calibrated import CalibratedRobot
from robocal.kinematics.model import LINK_IS_ANGLE, LINK_PARAMETERS

_DEG = np.pi / 180.0


def parameter_rows(calibrated: CalibratedRobot) -> list[dict[str, object]]:
    """One row a parameter in deg and mm; those without uncertainty were not fitted."""
    nominal, identified = calibrated.robot.geometry.links, calibrated.model.links
    n = nominal.size
    std = np.sqrt(np.diag(calibrated.covariance)[:n]).reshape(nominal.shape)
    return [
        {
            "name": f"{parameter}_{joint + 1}",
            "unit": "deg" if angle else "mm",
            "nominal": float(nominal[joint, column]) / unit,
            "identified": float(identified[joint, column]) / unit,
            "std": float(std[joint, column]) / unit,
            "status": "identified" if std[joint, column] > 0 else "fixed",
        }
        for joint in range(len(nominal))
        for column, (parameter, angle) in enumerate(
            zip(LINK_PARAMETERS, LINK_IS_ANGLE, strict=True)
        )
        for unit in (_DEG if angle else 1e-3,)
    ]
