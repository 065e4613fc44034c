"""How many single wrong readings are found, and how many good rows are rejected with them.

`python -m tests.studies.outliers --sets 300`: 100 positions of a robot off by about 0.4 mm and
1 mrad, read with 0.03 mm a coordinate; one row, or two of the hundred, off by 0.1 mm: on each axis,
or in length in any direction. Beside it what no test that rejects 0.2 % of good rows can exceed:
the power of chi-square with three degrees of freedom, for a residual that nothing was fitted to.
"""

import argparse
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy import stats

from robocal.formats.bundle import read_bundle
from robocal.identification.identify import identify
from robocal.instrument import InstrumentNoise
from tests.measured_cell import true_cell, write_bundle

ROWS = 100
NOISE = 3e-5
"""[m]"""
ERROR = 1e-4
"""[m]"""
FALSE_ALARMS = 2e-3
ROBOT = "staubli_tx60"


@dataclass
class Tally:
    """Rows over all sets."""

    spoiled: int = 0
    found: int = 0
    good: int = 0
    wrongly: int = 0


def errors(rng: np.random.Generator, count: int, *, each_axis: bool) -> np.ndarray:
    """Wrong readings: 0.1 mm on each axis, or 0.1 mm long."""
    if each_axis:
        return rng.choice([-ERROR, ERROR], size=(count, 3))
    direction = rng.normal(size=(count, 3))
    return ERROR * direction / np.linalg.norm(direction, axis=1, keepdims=True)


def count_found(sets: int, spoiled: int, *, each_axis: bool) -> Tally:
    """Identify so many sets, each with so many wrong rows."""
    tally = Tally()
    for seed in range(sets):
        rng = np.random.default_rng(1000 + seed)
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            cell = true_cell(ROBOT, seed)
            q = write_bundle(folder, ROBOT, cell, ROWS, seed, full_pose=False, noise=0.0)
            bundle = read_bundle(folder)
        position = cell.true.poses(q)[:, :3, 3] + NOISE * rng.normal(size=(ROWS, 3))
        which = rng.choice(ROWS, spoiled, replace=False)
        position[which] += errors(rng, spoiled, each_axis=each_axis)
        rows = replace(bundle.measurements, position=position, held_out=np.zeros(ROWS, dtype=bool))
        result = identify(replace(bundle, measurements=rows, instrument=InstrumentNoise(NOISE)))
        lines = {row.line for row in result.rejected}
        wrong = set(rows.lines[which].tolist())
        tally.spoiled += spoiled
        tally.found += len(lines & wrong)
        tally.good += ROWS - spoiled
        tally.wrongly += len(lines - wrong)
    return tally


def best_possible(*, each_axis: bool) -> float:
    """Power of the chi-square test at `FALSE_ALARMS` without any fit."""
    shift = (3 if each_axis else 1) * (ERROR / NOISE) ** 2
    return float(stats.ncx2.sf(stats.chi2.isf(FALSE_ALARMS, 3), 3, shift))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sets", type=int, default=200)
    sets = parser.parse_args().sets
    head = f"{'0.1 mm is':>16}{'wrong rows':>12}{'found':>9}{'at best':>9}{'good rejected':>15}"
    print(head)
    for each_axis in (True, False):
        for spoiled in (1, 2):
            tally = count_found(sets, spoiled, each_axis=each_axis)
            print(
                f"{'on each axis' if each_axis else 'the length':>16}{spoiled:12d}"
                f"{tally.found / tally.spoiled:9.1%}{best_possible(each_axis=each_axis):9.1%}"
                f"{tally.wrongly / tally.good:15.2%}"
            )


if __name__ == "__main__":
    main()
