"""Benchmarks that are programs of their own and have no peer: what they print, as it is."""

import subprocess
import sys

from tests.benchmarks.report import Goal


def _printed(title: str, *command: str) -> tuple[str, list[Goal]]:
    done = subprocess.run(
        [sys.executable, "-m", *command], capture_output=True, text=True, check=True
    )
    return f"## {title}\n\n```text\n{done.stdout.rstrip()}\n```\n", []


def planning() -> tuple[str, list[Goal]]:
    """CPU seconds of the pose selectors."""
    return _printed("Choice of poses", "tests.benchmarks.bench_planning", "speed")


def uncertainty() -> tuple[str, list[Goal]]:
    """CPU seconds of the Monte Carlo methods."""
    return _printed("Monte Carlo", "tests.benchmarks.bench_uncertainty")
