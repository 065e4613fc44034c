r"""Pose accuracy AP and pose repeatability RP of ISO 9283 from repeated visits to commanded poses.

With :math:`n` visits to one commanded pose, their barycentre :math:`(\bar x, \bar y, \bar z)` and
the distances :math:`l_j` of the visits from it,

.. math::
   AP_p = \sqrt{(\bar x - x_c)^2 + (\bar y - y_c)^2 + (\bar z - z_c)^2}, \qquad
   RP_l = \bar l + 3 S_l, \quad S_l = \sqrt{\tfrac{1}{n-1} \sum (l_j - \bar l)^2},

.. math::
   AP_a = \bar a - a_c, \qquad RP_a = \pm 3 S_a, \quad
   S_a = \sqrt{\tfrac{1}{n-1} \sum (a_j - \bar a)^2}

and likewise for b and c. The angles a, b, c are the small turns of the attained pose against the
commanded one about the commanded pose's own x, y and z: at a commanded pose they equal roll, pitch
and yaw to second order, and no pose is singular for them.

References
----------
.. [1] ISO 9283:1998, Manipulating industrial robots - Performance criteria and related test
   methods, 7.2.1 (pose accuracy) and 7.2.2 (pose repeatability).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.errors import BadInput
from robocal.frames import rotation_vector

VISITS_OF_THE_STANDARD = 30
"""Visits to every pose that the standard asks for; fewer give wider figures"""
_COVERAGE = 3.0
"""Standard deviations in the repeatability; clause 7.2.2"""


@dataclass(frozen=True)
class PoseFigures:
    """AP and RP of one commanded pose.

    Parameters
    ----------
    visits
        Number of visits.
    AP_position
        Distance of the barycentre from the commanded position [m].
    AP_axes
        Its components along the axes of the measuring frame [m].
    AP_angles
        Mean turns a, b, c [rad]; None without measured orientation.
    RP_position
        Radius RP_l [m]; None for a single visit.
    RP_angles
        Half widths of a, b, c [rad]; None for a single visit or without orientation.
    """

    visits: int
    AP_position: float
    AP_axes: Float[Array, "3"]
    AP_angles: Float[Array, "3"] | None
    RP_position: float | None
    RP_angles: Float[Array, "3"] | None


def pose_figures(
    commanded: Float[Array, "4 4"],
    attained: Float[Array, "visit 3"],
    rotations: Float[Array, "visit 3 3"] | None = None,
) -> PoseFigures:
    """AP and RP of one pose.

    Parameters
    ----------
    commanded
        Pose that was asked for, in the measuring frame.
    attained
        Measured positions [m], one a visit.
    rotations
        Measured orientations; None where the instrument sees none.

    Raises
    ------
    BadInput
        If there is no visit.
    """
    if not len(attained):
        raise BadInput("pose", "was not visited; its accuracy takes one visit at least")
    barycentre = attained.mean(axis=0)
    AP_axes = barycentre - commanded[:3, 3]
    AP_angles, RP_angles, RP_position = None, None, None
    if len(attained) > 1:
        distances = np.linalg.norm(attained - barycentre, axis=1)
        RP_position = float(distances.mean() + _COVERAGE * distances.std(ddof=1))
    if rotations is not None:
        turns = rotation_vector(commanded[:3, :3].T @ rotations)
        AP_angles = turns.mean(axis=0)
        if len(turns) > 1:
            RP_angles = _COVERAGE * turns.std(axis=0, ddof=1)
    return PoseFigures(
        visits=len(attained),
        AP_position=float(np.linalg.norm(AP_axes)),
        AP_axes=AP_axes,
        AP_angles=AP_angles,
        RP_position=RP_position,
        RP_angles=RP_angles,
    )


def pose_figures_document(figures: PoseFigures) -> dict[str, object]:
    """In mm and deg; None where there is nothing to say."""
    return {
        "visits": figures.visits,
        "AP_p_mm": figures.AP_position * 1e3,
        "AP_xyz_mm": _scaled(figures.AP_axes, 1e3),
        "AP_abc_deg": _scaled(figures.AP_angles, 180 / np.pi),
        "RP_l_mm": None if figures.RP_position is None else figures.RP_position * 1e3,
        "RP_abc_deg": _scaled(figures.RP_angles, 180 / np.pi),
    }


def _scaled(values: Float[Array, "3"] | None, factor: float) -> list[float] | None:
    return None if values is None else [float(value) * factor for value in values]
