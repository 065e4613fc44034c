"""Does the closed-form start reach the optimum that a start at the truth reaches?

`python -m tests.studies.starts --cells 1000` prints one line a robot and kind of measurement.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from robocal.formats.bundle import read_bundle
from robocal.identification.cell_model import CellModel
from robocal.identification.prepared import prepare
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import frames_alone, solve
from robocal.kinematics.model import KinematicModel
from tests.measured_cell import Cell, true_cell, write_bundle

ROBOTS = ("staubli_tx60", "ur10e", "abb_irb120", "kuka_iiwa14", "abb_irb910sc")
POSES = 60
SAME_COST = 1e-6
"""Largest relative difference of the two minima that counts as the same one; [1]"""


@dataclass(frozen=True)
class Outcome:
    """Sums of squared whitened residuals at the two minima.

    Without the priors: these are centred on each start's own frames, so that along directions the
    data hardly see (a SCARA's tool height) the two prior terms differ while the fits agree.
    """

    from_closed_form: float
    from_truth: float

    @property
    def excess(self) -> float:
        """By how much the closed-form start ends higher, relative."""
        return (self.from_closed_form - self.from_truth) / self.from_truth


def run_cell(robot: str, seed: int, *, full_pose: bool) -> Outcome:
    """One random cell in any frames, identified from both starts."""
    rng = np.random.default_rng(seed)
    cell = true_cell(robot, seed, tool_point=tuple(rng.normal(size=3) * 0.15))
    with TemporaryDirectory() as folder:
        write_bundle(Path(folder), robot, cell, POSES, seed, full_pose=full_pose)
        bundle = read_bundle(Path(folder))
    ready = prepare(bundle, bundle.choices)
    rows = ready.observe(bundle, np.ones(POSES, dtype=bool))
    how = identify_simultaneously
    before = frames_alone(ready.start, rows, ready.choices, how)
    ours = solve(before.cell, rows, ready.choices, how)
    near_truth = _truth(cell, ready.start, ours.problem.free)
    theirs = solve(near_truth, rows, ready.choices, how, before.cell)
    return Outcome(ours.chi_square, theirs.chi_square)


def _truth(cell: Cell, start: CellModel, free: np.ndarray) -> CellModel:
    """The true cell; redundant parameters, which no data tell, at their nominal values."""
    true = cell.true
    links = start.geometry.links.ravel().copy()
    told = free[free < links.size]
    links[told] = true.links.ravel()[told]
    geometry = KinematicModel(
        links.reshape(-1, 5), start.geometry.prismatic, station=true.base, flange=true.tool
    )
    return CellModel(geometry, start.flange)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=1000)
    cells = parser.parse_args().cells
    each = -(-cells // (2 * len(ROBOTS)))
    print(f"{'robot':14}{'rows':>12}{'cells':>7}{'same optimum':>14}{'largest excess':>16}")
    for robot in ROBOTS:
        for full_pose in (True, False):
            excess = np.array([
                run_cell(robot, seed, full_pose=full_pose).excess for seed in range(each)
            ])
            kind = "full poses" if full_pose else "positions"
            same = int((excess <= SAME_COST).sum())
            print(f"{robot:14}{kind:>12}{each:7d}{same:14d}{excess.max():16.1e}", flush=True)


if __name__ == "__main__":
    main()
