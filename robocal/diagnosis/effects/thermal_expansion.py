"""Links grow with temperature.

delta L_i = alpha L_i (T - mean T): every length of the nominal geometry by the same share.
"""

from jaxtyping import Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import (
    Coefficient,
    Follows,
    Instance,
    Moves,
    column,
)

PRIOR = 2.3e-5
"""Aluminium 23, steel 12 parts in a million a kelvin [1/K]"""


class ThermalExpansion:
    """Links grow with temperature."""

    name = "thermal_expansion"
    follows = Follows.time
    advice = (
        "let the robot reach its working temperature, or compensate with the temperature as it "
        "is read"
    )
    needs = "temperature_degc, varying"

    def instances(self, rows: Circumstances) -> list[Instance]:
        """Every place where it could act."""
        if not rows.has_temperature:
            return []
        return [Instance(self.name, None, (), (Coefficient("expansion_per_k", PRIOR),))]

    def moves(self, rows: Circumstances, instance: Instance) -> Moves:
        """Changes of the parameters for coefficients of one."""
        return growth(rows, rows.warmer)


def growth(rows: Circumstances, share: Float[Array, "row"]) -> Moves:
    """Every nominal length a and d grows by a share of itself."""
    moves: Moves = {}
    for link, lengths in enumerate(rows.robot.geometry.links[:, 1:3]):
        for offset, length in enumerate(lengths, start=1):
            if length != 0.0:
                moves[5 * link + offset] = column(length * share)
    return moves
