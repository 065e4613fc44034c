"""The instrument's ranges are off by a factor.

p = (1 + s) p. All lengths of the arm and both frames' shifts take it up exactly: without a scale
bar or a trusted length it is hidden, and is never screened.
"""

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Follows,
    Instance,
    Moves,
    base_index,
    column,
)


class InstrumentScale:
    """The instrument's ranges are off by a factor."""

    name = "instrument_scale"
    follows = Follows.sight
    advice = "measure a scale bar, and set temperature and pressure at the instrument"
    needs = "a scale bar"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        return []

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        scaled = rows.position @ rows.base_rotation
        first = base_index(rows)
        return {first + axis: column(scaled[:, axis]) for axis in range(3)}
