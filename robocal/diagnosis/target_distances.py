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
from robocal.instrument import InstrumentNoise
from robocal.measurements import MeasurementSet


@dataclass(frozen=True)
class Targets:
    """Measured rows with their circumstances, row for row the same."""

    measured: MeasurementSet
    around: Circumstances

    @property
    def placed(self) -> Bool[Array, "row"]:
        """Rows with a position or a length."""
        position = np.isfinite(self.measured.position).all(axis=1)
        return np.asarray(position | np.isfinite(self.measured.distance))

    def some(self, rows: Bool[Array, "row"]) -> "Targets":
        """Some of the rows."""
        return Targets(self.measured.rows(rows), self.around.rows(rows))

    def noise_floor(self, instrument: InstrumentNoise) -> float:
        """RMS distance that the instrument's noise alone leaves [m]."""
        spread = 3.0 * instrument.position_std(self.measured.position) ** 2
        length = instrument.distance_std(self.measured.distance) ** 2
        each = np.where(np.isnan(spread), length, spread)
        return float(np.sqrt(np.mean(each))) if len(each) else 0.0

    def distances(self, cell: CellModel, moves: Moves) -> Float[Array, "row"]:
        """Distance from the prediction, of lengths their error [m]; zero where there is neither."""
        sizes = np.zeros(len(self.measured))
        for place in range(-1, len(cell.place_names)):
            name = "" if place < 0 else cell.place_names[place]
            here = np.array([target == name for target in self.measured.target])
            if here.any():
                there = {parameter: values[here] for parameter, values in moves.items()}
                target = predict_at(cell.at_place(place), self.measured.joints[here], there)
                miss = np.linalg.norm(self.measured.position[here] - target.p.T, axis=1)
                if cell.anchor is not None:
                    length = np.linalg.norm(target.p - cell.anchor[:, None], axis=0)
                    too_long = np.abs(self.measured.distance[here] - length)
                    miss = np.where(np.isnan(miss), too_long, miss)
                sizes[here] = np.nan_to_num(miss)
        return sizes

    def with_all(self, found: JointFit) -> Float[Array, "row"]:
        """With all effects."""
        return self.distances(found.cell, moves_of(self.around, found.effects))

    def without(self, found: JointFit, positions: list[int]) -> Float[Array, "row"]:
        """With some effects taken out and the rest fitted again."""
        if not positions:
            return self.with_all(found)
        cell, rest = found.refitted_without(*positions)
        return self.distances(cell, moves_of(self.around, rest))
