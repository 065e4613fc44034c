"""CPU seconds of the Monte Carlo methods: `python -m tests.benchmarks.bench_uncertainty`.

One numerics thread (OPENBLAS_NUM_THREADS=1). Goals: 1,000 refits of a 50-pose calibration within
5 s, 10,000 draws of the tool's position at 50 poses within 1 s.
"""

import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from robocal.formats.bundle import read_bundle
from robocal.identification.identify import identify
from robocal.uncertainty.fitted_rows import FittedRows, fitted_rows
from robocal.uncertainty.refits import refit
from robocal.uncertainty.repeats import scatter_of_repeats
from robocal.uncertainty.sources import sources_of
from robocal.uncertainty.tool_draws import draw_parameters, tool_moves
from tests.measured_cell import true_cell, write_bundle

POSES = 50
ROUNDS = 3
ROBOTS = ("staubli_tx60", "ur10e")


def fitted(robot: str, *, full_pose: bool) -> FittedRows:
    """50 poses, all of them fitted."""
    with tempfile.TemporaryDirectory() as folder:
        write_bundle(Path(folder), robot, true_cell(robot, 1), POSES, full_pose=full_pose)
        bundle = read_bundle(Path(folder))
    everything = replace(bundle.measurements, held_out=np.zeros(POSES, dtype=bool))
    bundle = replace(bundle, measurements=everything)
    return fitted_rows(bundle, identify(bundle))


def least_cpu(work: Callable[[], object]) -> float:
    """CPU seconds of the quickest of three rounds."""
    spent = []
    for _ in range(ROUNDS):
        started = time.process_time()
        work()
        spent.append(time.process_time() - started)
    return min(spent)


def main() -> None:
    """Print the table."""
    print(f"{'robot':14}{'rows':>12}{'1,000 refits [CPU s]':>24}{'10,000 draws, 50 poses':>26}")
    for robot in ROBOTS:
        for full_pose in (True, False):
            fit = fitted(robot, full_pose=full_pose)
            repeats = scatter_of_repeats(fit)
            sources = sources_of(fit, repeats)
            refits = least_cpu(lambda fit=fit, repeats=repeats: refit(fit, repeats, 1000, 1))
            draws = least_cpu(
                lambda fit=fit, sources=sources: tool_moves(
                    fit.result.model,
                    draw_parameters(sources, np.random.default_rng(1), 10_000),
                    fit.rows.joints,
                )
            )
            kind = "full poses" if full_pose else "positions"
            print(f"{robot:14}{kind:>12}{refits:24.2f}{draws:26.2f}", flush=True)


if __name__ == "__main__":
    main()
