"""The strategies side by side, from frame guesses that are wrong by a known amount.

`python -m tests.studies.strategies --cells 100` prints the table of docs/identification.md. The
closed-form start is left out on purpose: it is what makes either strategy global.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.spatial.transform import Rotation

from robocal.formats.bundle import read_bundle
from robocal.identification.cell_model import CellModel
from robocal.identification.observations import Observations
from robocal.identification.prepared import Prepared, prepare
from robocal.identification.priors import prior_std
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import frames_alone, structure
from robocal.identification.strategies import STRATEGIES
from robocal.identification.strategy import Problem
from tests.measured_cell import true_cell, write_bundle

ROBOT = "staubli_tx60"
POSES = 60
GUESSES = ((0.3, 0.1), (0.8, 0.3), (1.5, 0.5), (2.5, 1.0))
"""Standard deviation per axis of the frames' guesses: [rad], [m]"""
SAME = 1e-6


def wrong_by(start: CellModel, angle: float, length: float, rng: np.random.Generator) -> CellModel:
    """The same cell with base and tool guessed wrong."""
    frames = []
    for frame in (start.geometry.station, start.geometry.flange):
        T = frame.copy()
        T[:3, :3] = Rotation.from_rotvec(rng.normal(size=3) * angle).as_matrix() @ T[:3, :3]
        T[:3, 3] += rng.normal(size=3) * length
        frames.append(T)
    return replace(start, geometry=replace(start.geometry, station=frames[0], flange=frames[1]))


def prepared(seed: int) -> tuple[Prepared, Observations]:
    """One measured cell, full poses."""
    with TemporaryDirectory() as folder:
        write_bundle(Path(folder), ROBOT, true_cell(ROBOT, seed), POSES, seed)
        bundle = read_bundle(Path(folder))
    ready = prepare(bundle, bundle.choices)
    return ready, ready.observe(bundle, np.ones(POSES, dtype=bool))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=100)
    cells = parser.parse_args().cells
    print(f"{'guess off by':>16}{'strategy':>14}{'optimum':>9}{'iterations':>12}{'CPU ms':>8}")
    for angle, length in GUESSES:
        reached = dict.fromkeys(STRATEGIES, 0)
        iterations = {name: [] for name in STRATEGIES}
        seconds = {name: [] for name in STRATEGIES}
        for seed in range(cells):
            rng = np.random.default_rng(seed)
            ready, rows = prepared(seed)
            best = frames_alone(ready.start, rows, ready.choices, identify_simultaneously).cell
            std = prior_std(best, ready.choices)
            seen = structure(best, rows, std)
            free = np.flatnonzero(seen.identified | seen.weak)
            problem = Problem(best, rows, free, best.vector, std**-2.0)
            optimum = identify_simultaneously(problem).minimum.equations.cost
            guess = wrong_by(ready.start, angle, length, rng)
            for name, strategy in STRATEGIES.items():
                began = time.process_time()
                fit = strategy(replace(problem, start=guess))
                seconds[name].append(time.process_time() - began)
                iterations[name].append(fit.iterations)
                reached[name] += fit.minimum.equations.cost <= optimum * (1 + SAME)
        for name in STRATEGIES:
            print(
                f"{angle:6.1f} rad {length:3.1f} m{name:>14}{reached[name]:5d}/{cells}"
                f"{np.median(iterations[name]):12.0f}{1e3 * np.median(seconds[name]):8.0f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
