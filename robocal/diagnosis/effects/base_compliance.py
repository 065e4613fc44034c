"""Pedestal or base plate tilts with the overturning moment.

omega = C (M_x, M_y): the whole arm turns about the horizontal axes of its base.
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Instance,
    Moves,
    base_index,
)
from robocal.diagnosis.unknown_masses import (
    moments_of_unit_masses,
    point_of,
    unit_mass_coefficients,
)

_TILT = "tilt_rad_per_nm"
PRIOR = 4e-6
"""1 to 10 microradian a newton metre [rad/Nm]"""
LEAST_MOMENT = 0.1
"""[Nm]"""


class BaseCompliance:
    """Pedestal or base plate tilts with the overturning moment."""

    name = "base_compliance"
    advice = (
        "tighten the bolts of the base plate, stiffen the pedestal, and put a nest on the base "
        "plate to watch it"
    )
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        coefficients: tuple[Coefficient, ...] = (Coefficient(_TILT, PRIOR),)
        if rows.robot.masses is None:
            loads = {n: load[:2] for n, load in moments_of_unit_masses(rows).items()}
            unknown = unit_mass_coefficients("tilt", PRIOR, loads, LEAST_MOMENT)
            coefficients = (*unknown, *coefficients) if rows.has_payload else unknown
        elif np.ptp(rows.moment[:2]) < LEAST_MOMENT:
            return []
        return [Instance(self.name, None, (), coefficients)] if coefficients else []

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        points = [point_of(coefficient) for coefficient in instance.coefficients]
        loads = moments_of_unit_masses(rows) if any(points) else {}
        moments = [loads[point] if point else rows.moment for point in points]
        first = base_index(rows)
        return {
            first + 5: np.stack([moment[0] for moment in moments], axis=1),
            first + 4: np.stack([moment[1] for moment in moments], axis=1),
        }
