"""Robot or station moves, steadily or ever more slowly.

p += d s(t), along three axes, t from 0 to 1 over the campaign: s = t, or of a stand that settles
s = (1 - exp(-t / T)) / (1 - exp(-1 / T)).
"""

import numpy as np

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    base_index,
)

_SHARE = "time_constant_share"
SETTLING = 0.35
"""Time constant of a stand that settles, as a share of the campaign; [1]"""
PRIOR = 1.5e-4
"""Over the whole campaign [m]"""


class BaseDrift:
    """Robot or station moves, steadily or ever more slowly."""

    name = "base_drift"
    follows = Follows.time
    advice = (
        "let station and tripod settle, shield them from sun and draught, and re-measure fixed "
        "nests"
    )
    needs = ""

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        coefficients = tuple(Coefficient(f"drift_{axis}_m", PRIOR) for axis in "xyz")
        settling = ((_SHARE, SETTLING),)
        return [Instance(self.name, None, how, coefficients) for how in ((), settling)]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        first, way = base_index(rows), rows.progress
        share = dict(instance.arguments).get(_SHARE)
        if share is not None:
            way = np.expm1(-way / share) / np.expm1(-1.0 / share)
        return {first + axis: way[:, None] * np.eye(3)[axis] for axis in range(3)}
