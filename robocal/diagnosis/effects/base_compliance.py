"""Pedestal or base plate tilts with the overturning moment.

omega = C (M_x, M_y): the whole arm turns about the horizontal axes of its base. Where the masses
are unknown it is not offered unless the payload varies: with a free number for every mass it cannot
be told from joint 2 yielding, which is the commoner cause.
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    base_index,
    column,
)
from robocal.diagnosis.load_size import compliance_of

YIELD = 4e-4
"""Under the largest overturning moment [rad]"""
LEAST_MOMENT = 0.1
"""[Nm]"""


class BaseCompliance:
    """Pedestal or base plate tilts with the overturning moment."""

    name = "base_compliance"
    follows = Follows.load
    advice = (
        "tighten the bolts of the base plate, stiffen the pedestal, and put a nest on the base "
        "plate to watch it"
    )
    needs = "link masses in robot.yaml, or payload_kg, varying"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        if rows.robot.masses is None and not rows.has_payload:
            return []
        if np.ptp(rows.moment[:2]) < LEAST_MOMENT:
            return []
        prior = compliance_of(YIELD, rows.moment[:2])
        return [Instance(self.name, None, (), (Coefficient("tilt_rad_per_nm", prior),))]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        first = base_index(rows)
        return {first + 5: column(rows.moment[0]), first + 4: column(rows.moment[1])}
