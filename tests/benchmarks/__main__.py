"""`make bench`: all comparisons as Markdown, then the figures to reach.

`python -m tests.benchmarks [identification] [kinematics] [startup] [planning] [uncertainty] [load]`
runs some of them. Exit status 1 says that a figure was missed.
"""

import os
import platform
import sys
from pathlib import Path

from tests.benchmarks import identification, kinematics, load, programs, startup
from tests.benchmarks.report import Goal

PARTS = {
    "identification": identification.run,
    "kinematics": kinematics.run,
    "startup": startup.run,
    "planning": programs.planning,
    "uncertainty": programs.uncertainty,
    "load": load.run,
}


def machine() -> str:
    """Processor, interpreter and what else the machine does."""
    cpu_info = Path("/proc/cpuinfo")
    names = [platform.processor() or platform.machine()]
    if cpu_info.exists():
        lines = cpu_info.read_text().splitlines()
        names += [line.partition(":")[2].strip() for line in lines if "model name" in line][:1]
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg())
    return (
        f"{names[-1]}, {os.cpu_count()} processors, CPython {platform.python_version()}, "
        f"load average {load}, one numerics thread"
    )


def main() -> int:
    """Print tables as they come."""
    if os.environ.get("OPENBLAS_NUM_THREADS") != "1":
        sys.stderr.write("set OPENBLAS_NUM_THREADS=1, as `make bench` does\n")
        return 2
    found: list[Goal] = []
    sys.stdout.write(f"{machine()}\n\n")
    for name in sys.argv[1:] or PARTS:
        text, goals = PARTS[name]()
        sys.stdout.write(f"{text}\n")
        sys.stdout.flush()
        found += goals
    sys.stdout.write(f"{machine()}\n\n")
    sys.stdout.writelines(f"{goal}\n" for goal in found)
    return 0 if all(goal.holds for goal in found) else 1


if __name__ == "__main__":
    sys.exit(main())
