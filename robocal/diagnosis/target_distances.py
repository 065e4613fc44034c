"""How far every measured target is from its prediction, with all effects and with some less."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray as Array

from robocal.diagnosis.circumstances import Circumstances
from robocal.diagnosis.effect import Moves
from robocal.diagnosis.extended import moves_of, predict_at
from robocal.diagnosis.joint_fit import JointFit
from robocal.identification.cell_model import CellModel
from robocal.measurements import MeasurementSet


@dataclass(frozen=True)
class Targets:
    """Measured rows with their circumstances, row for row the same."""

    measured: MeasurementSet
    around: Circumstances

    def some(self, rows: Bool[Array, "row"]) -> "Targets":
        """Some of the rows."""
        return Targets(self.measured.rows(rows), self.around.rows(rows))

    def distances(self, cell: CellModel, moves: Moves) -> Float[Array, "row"]:
        """Distance from the prediction [m]; zero where there is no position."""
        sizes = np.zeros(len(self.measured))
        for place in range(-1, len(cell.place_names)):
            name = "" if place < 0 else cell.place_names[place]
            here = np.array([target == name for target in self.measured.target])
            if here.any():
                there = {parameter: values[here] for parameter, values in moves.items()}
                target = predict_at(cell.at_place(place), self.measured.joints[here], there)
                miss = self.measured.position[here] - target.p.T
                sizes[here] = np.nan_to_num(np.linalg.norm(miss, axis=1))
        return sizes

    def with_all(self, found: JointFit) -> Float[Array, "row"]:
        """With all effects."""
        return self.distances(found.cell, moves_of(self.around, found.effects))

    def without(self, found: JointFit, positions: list[int]) -> Float[Array, "row"]:
        """With some effects taken out, the rest as it is."""
        rest = tuple(f for k, f in enumerate(found.effects) if k not in positions)
        return self.distances(found.cell, moves_of(self.around, rest))
