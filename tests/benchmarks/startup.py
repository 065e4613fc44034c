"""How long a process takes to import robocal, and to print the help.

Wall time counts where the machine is quiet. Where more processes want to run than there are
processors it says more of them than of us, and CPU time counts.
"""

import os
import statistics
import subprocess
import sys
import time
from pathlib import Path

from tests.benchmarks.report import Goal, table

ROUNDS = 9
BIN = Path(sys.executable).parent
COMMANDS = (
    ("import robocal", (sys.executable, "-c", "import robocal"), 0.3),
    (
        "import robocal.identification.identify",
        (sys.executable, "-c", "import robocal.identification.identify"),
        None,
    ),
    ("robocal --help", (str(BIN / "robocal"), "--help"), 0.6),
)


def times(command: tuple[str, ...]) -> tuple[float, float]:
    """Median wall and CPU seconds of whole processes, after one that fills the disk cache."""
    wall, cpu = [], []
    for _ in range(ROUNDS + 1):
        before, began = os.times(), time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        wall.append(time.perf_counter() - began)
        after = os.times()
        cpu.append(
            after.children_user
            + after.children_system
            - before.children_user
            - before.children_system
        )
    return statistics.median(wall[1:]), statistics.median(cpu[1:])


def run() -> tuple[str, list[Goal]]:
    """All commands."""
    rows, goals = [], []
    busy = os.getloadavg()[0] > (os.cpu_count() or 1)
    for name, command, most in COMMANDS:
        wall, cpu = times(command)
        rows.append((name, f"{wall:.3f}", f"{cpu:.2f}"))
        if most is not None:
            counts, unit = (cpu, "CPU s") if busy else (wall, "s")
            goals.append(Goal(name, f"{counts:.3f} {unit}", f"<= {most} s", counts <= most))
    head = ("process", f"wall s, median of {ROUNDS}", "CPU s")
    return f"## Start\n\n{table(head, rows)}\n", goals
