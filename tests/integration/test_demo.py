"""`robocal demo`: it shows that calibration helps, and leaves nothing running however it ends."""

import os
import re
import signal
import subprocess
import sys
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest
from service_cell import wait_until

ROOT = Path(__file__).parents[2]
ENTRY = "from service.cli import main; main()"
LONGEST_S = 120

pytestmark = pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="needs /proc")


class Demo:
    """The demonstration in a process of its own, its offspring known by a mark."""

    def __init__(self, *arguments: str) -> None:
        self._mark = f"ROBOCAL_TEST_MARK={uuid.uuid4()}"
        name, _, value = self._mark.partition("=")
        self.process = subprocess.Popen(
            [sys.executable, "-c", ENTRY, "demo", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=ROOT,
            env=os.environ | {name: value},
        )

    def family(self) -> list[int]:
        """Processes that are still there, itself included."""
        found = []
        for entry in Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            try:
                environment = (entry / "environ").read_bytes()
            except (FileNotFoundError, PermissionError, ProcessLookupError):
                continue
            if self._mark.encode() in environment:
                found.append(int(entry.name))
        return found

    def until_the_service_runs(self) -> None:
        for line in self.process.stdout:
            if line.startswith("service at "):
                return
        raise AssertionError("the service did not start")

    def end(self) -> tuple[int, str]:
        """Exit status and what was printed."""
        printed = self.process.stdout.read()
        return self.process.wait(LONGEST_S), printed

    def close(self) -> None:
        for pid in self.family():
            os.kill(pid, signal.SIGKILL)
        self.process.wait()
        self.process.stdout.close()


@pytest.fixture
def demo() -> Iterator[Demo]:
    started: list[Demo] = []

    def start(*arguments: str) -> Demo:
        started.append(Demo(*arguments))
        return started[-1]

    yield start
    for one in started:
        one.close()


def rms_mm(printed: str, row: str) -> float:
    return float(re.search(rf"^ +{row} +([\d.]+)", printed, re.MULTILINE)[1])


def test_calibration_makes_the_error_smaller_and_nothing_stays(demo):
    run = demo("--once", "--poses", "20", "--targets", "4")
    status, printed = run.end()
    assert status == 0, printed
    assert run.family() == []
    before = rms_mm(printed, "nominal geometry, frames fitted")
    assert rms_mm(printed, "identified geometry") < 0.3 * before
    assert rms_mm(printed, "compensated joints") < 0.3 * rms_mm(printed, "nominal joints")
    assert "time per pose (median): motion" in printed
    for noise in ("alembic", "ur_controller", "Traceback", "WARNING", "took the job"):
        assert noise not in printed


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stopped_in_the_middle_it_ends_quietly_and_nothing_stays(demo, number):
    run = demo("--poses", "500")
    run.until_the_service_runs()
    assert len(run.family()) > 4
    run.process.send_signal(number)
    status, printed = run.end()
    assert status == 128 + signal.SIGINT
    assert "Traceback" not in printed
    assert "stopped before the end" in printed
    assert run.family() == []


def test_killed_it_takes_everything_with_it(demo):
    run = demo("--poses", "500")
    run.until_the_service_runs()
    run.process.kill()
    run.process.wait()
    wait_until(lambda: run.family() == [], period_s=0.1)
