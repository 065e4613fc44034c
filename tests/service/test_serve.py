"""`robocal serve` as a process: what keeps it going and what it says when it cannot start."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

ENTRY = [sys.executable, "-c", "from service.cli import main; main()", "serve", "--port", "0"]
ROOT = Path(__file__).parents[2]
DEADLINE_S = 30.0


@pytest.fixture
def served(database_url: str, tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    with (tmp_path / "log").open("w") as log:
        process = subprocess.Popen(
            ENTRY,
            env=os.environ | {"ROBOCAL_DATABASE_URL": database_url},
            stdout=subprocess.PIPE,
            stderr=log,
            text=True,
            cwd=ROOT,
        )
    with process:
        assert process.stdout is not None
        assert json.loads(process.stdout.readline())["ready"] is True
        yield process
        process.send_signal(signal.SIGINT)


def test_a_worker_that_dies_is_replaced_and_that_is_said(served, tmp_path):
    first = _awaited(lambda: _workers(served.pid))
    os.kill(first[0], signal.SIGKILL)
    second = _awaited(lambda: [pid for pid in _workers(served.pid) if pid not in first])
    assert len(second) == 1
    log = (tmp_path / "log").read_text()
    assert log.count("service.jobs.worker ended with status -9; starting it again\n") == 1


def _workers(parent: int) -> list[int]:
    """The workers that a process has started, as the kernel lists them."""
    listed = subprocess.run(
        ["ps", "-o", "pid=,args=", "--ppid", str(parent)], capture_output=True, text=True
    ).stdout
    return [int(line.split()[0]) for line in listed.splitlines() if "service.jobs.worker" in line]


def _awaited(look: Callable[[], list[int]]) -> list[int]:
    deadline = time.monotonic() + DEADLINE_S
    while not (found := look()):
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.05)
    return found
