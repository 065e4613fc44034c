"""The arm grows with time, without a sensor that says so.

delta L_i = L_i s (1 - exp(-t / tau)): a first-order warm-up, its time constant searched.
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
)
from robocal.diagnosis.effects.thermal_expansion import growth

PRIOR = 3e-4
"""23 parts in a million a kelvin over 15 kelvin; [1]"""
SHARES = (0.1, 0.2, 0.4, 0.8, 1.6)
"""Time constants tried, as shares of the campaign; [1]"""


class WarmUp:
    """The arm grows with time, without a sensor that says so."""

    name = "warm_up"
    follows = Follows.time
    advice = "warm up before work for about three time constants"
    needs = "t_s, and no temperature_degc that varies"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        span = float(np.ptp(rows.time))
        if rows.has_temperature or not rows.timed or span <= 0:
            return []
        return [
            Instance(self.name, None, (("tau_s", share * span),), (Coefficient("growth", PRIOR),))
            for share in SHARES
        ]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        rise = 1.0 - np.exp(-(rows.time - rows.reference.time_start) / instance.argument("tau_s"))
        return growth(rows, rise)
