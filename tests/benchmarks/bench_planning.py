"""CPU time of every selector, and what the chosen sets are worth.

`python -m tests.benchmarks.bench_planning [speed] [compare] [document]`:

`speed` prints CPU seconds for 30 of 200 and 50 of 1,000 poses; `compare` calibrates robots with
known errors on 20 seeds and prints the tool's error and uncertainty at 200 test poses, each choice
against random sets of the same size; `document` prints document 002's numbers beside ours.
"""

import sys
import time

import numpy as np

from robocal.planning import detmax
from robocal.planning.candidates import draw_candidates
from robocal.planning.cell import Box, Cell
from robocal.planning.chosen_set import Selection
from robocal.planning.comparison import Choice, compare
from robocal.planning.curve import index_curve
from robocal.planning.document_002 import document_rows
from robocal.planning.observability import INDICES, observability
from robocal.planning.pose_rows import pose_rows, scale_columns
from robocal.planning.selectors import MERITS, SELECTORS, merit
from robocal.robots.library import load_robot

SIZES = ((200, 30), (1000, 50))
REPEATS = 3
SEEDS = 20
CHOICES = (
    *(Choice("detmax", name) for name in MERITS),
    Choice("exchange", "O1"),
    Choice("relaxed", "O1"),
    Choice("random", "O1"),
)
DOCUMENT_CELL = Cell((0.0, 0.0, 0.0), Box((-0.2, -0.6, -0.2), (0.7, 0.6, 0.6)), floor=-0.375)
"""Document 002, section 4.2: 900 x 1200 x 800 mm about (250, 0, 200)"""
DOCUMENT_COUNTS = {"O1": 61, "O2": 29}


def speed():
    robot = load_robot("ur10")
    print(f"{'poses':>12} {'merit':>10} {'selector':>10} {'CPU s (least of 3)':>20} {'index':>10}")
    for candidates, count in SIZES:
        q = draw_candidates(robot, candidates, np.random.default_rng(1))
        started = time.process_time()
        rows = pose_rows(robot, Cell(), q)
        print(f"rows of {candidates} candidates: {time.process_time() - started:.3f} CPU s")
        test_rows = rows.position_rows(q[:100])
        for name in MERITS:
            for selector in ("detmax", "exchange"):
                selection = Selection(rows.J, count, merit(name, test_rows), seed=1)
                spent = []
                for _ in range(REPEATS):
                    started = time.process_time()
                    chosen = SELECTORS[selector](selection)
                    spent.append(time.process_time() - started)
                value = observability(rows.J[chosen]).get(name, float("nan"))
                print(
                    f"{count:>4} of {candidates:<5} {name:>10} {selector:>10} "
                    f"{min(spent):>20.3f} {value:>10.4f}"
                )


def compare_selectors():
    robot = load_robot("ur10e")
    cell = Cell(workspace=Box((0.3, -0.4, 0.2), (0.9, 0.4, 0.8)))
    worths = [compare(robot, cell, CHOICES, 200, 30, seed) for seed in range(SEEDS)]
    error = np.array([[worth.error for worth in of_seed] for of_seed in worths]) * 1e3
    predicted = np.array([[worth.predicted for worth in of_seed] for of_seed in worths]) * 1e3
    print(f"{robot.name}, 30 of 200 poses, {SEEDS} seeds, 200 test poses in the workspace")
    print(f"{'choice':>20} {'error RMS mm':>13} {'U95 mean mm':>12} {'/ random':>13} {'better':>7}")
    for column, choice in enumerate(CHOICES):
        ratio = np.exp(np.log(predicted[:, column] / predicted[:, -1]).mean())
        better = int((predicted[:, column] < predicted[:, -1]).sum())
        rms = np.sqrt((error[:, column] ** 2).mean())
        print(
            f"{choice.selector + ' ' + choice.merit:>20} {rms:>13.4f} "
            f"{predicted[:, column].mean():>12.4f} {ratio:>13.3f} {better:>4}/{SEEDS}"
        )


def document():
    robot = load_robot("staubli_tx60")
    q = draw_candidates(robot, 1000, np.random.default_rng(1), DOCUMENT_CELL)
    J, _ = scale_columns(document_rows(robot.geometry, q))
    rank = np.linalg.matrix_rank(J.reshape(-1, J.shape[2]))
    print(f"parameters: document 24, here {J.shape[2]} of rank {rank}")
    curve = index_curve(J, seed=1)
    for name in INDICES:
        print(
            f"{name} settles: paper {DOCUMENT_COUNTS.get(name)}, ours {curve.settled_count(name)}"
        )
        points = [2, 5, 10, 20, 29, 40, 61, 100, 160]
        means = [curve.mean[name][np.searchsorted(curve.counts, point)] for point in points]
        print("  " + ", ".join(f"{n}: {m:.4f}" for n, m in zip(points, means, strict=True)))
    for name, count in DOCUMENT_COUNTS.items():
        selection = Selection(J, count, merit(name, np.empty((0, 3, 24))), seed=1)
        chosen = detmax.search_from_random(selection)
        found = observability(J[chosen])[name]
        mean = curve.mean[name][np.searchsorted(curve.counts, count)]
        print(f"{name}: DETMAX {found:.4f}, random {mean:.4f} ({count} poses)")


if __name__ == "__main__":
    parts = {"speed": speed, "compare": compare_selectors, "document": document}
    for part in sys.argv[1:] or parts:
        parts[part]()
