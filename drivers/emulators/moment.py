"""Whether the moment of a sudden effect has come."""

from __future__ import annotations

import numpy as np

from drivers.emulators.stance import Circumstances
from drivers.emulators.true_arm import Vector


def has_come(now: Circumstances, at_s: float, after_readings: float, creep_s: float) -> Vector:
    """1 from a world time or a number of readings on, 0 before.

    With `creep_s` it comes from `at_s` on as 1 - exp(-t / creep_s).
    """
    come = (now.time_s >= at_s) | (now.readings >= after_readings)
    share = np.where(come, 1.0, 0.0)
    if creep_s == 0.0:
        return share
    gone = np.maximum(now.time_s - at_s, 0.0)
    return np.asarray(share * -np.expm1(-gone / creep_s))
