"""Kill -9 of everything, again and again: `python -m tests.studies.power_cuts [--cuts 50]`.

One campaign on an emulated cell. At a random moment every process of the installation is killed
(the service, its worker, what they started), as when the power goes; then `robocal serve` is
started anew and has to go on by itself. The cell's own record is the oracle: a reading lost,
doubled, changed, or taken of another pose is counted.
"""

import argparse
import json
import os
import random
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import numpy as np
import psutil

from tests.benchmarks.report import table
from tests.credentials import BEARER, KEY, SETTING
from tests.integration.service_cell import World, poses_about_start, wait_until

LEASE_S = 2.0
NOISE = 2e-4
"""Ten times the scatter of instrument and robot [m]"""
SEED = 20261122
POSES_PER_CUT = 7
"""More than a fast machine measures between two cuts: two, and those of the moment's wait."""


@dataclass(frozen=True)
class Cut:
    """One cut and what the next start said and found."""

    readings: int
    said: str
    back_s: float
    """From the start of the program to the next accepted reading [s]."""


@dataclass(frozen=True)
class Outcome:
    """All cuts, and what was wrong in the end."""

    cuts: list[Cut]
    poses: int
    lost: int
    doubled: int
    changed: int
    wrong_pose: int
    driven_again: int
    integrity: str


class Installation:
    """`robocal serve` on one file, killed and started."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "robocal.sqlite3"
        self._log = folder / "log"
        self._environment = os.environ | {
            "ROBOCAL_DATABASE_URL": f"sqlite:///{self.file}",
            "ROBOCAL_PORT": "0",
            "ROBOCAL_LEASE_S": str(LEASE_S),
            SETTING: KEY,
        }

    def start(self) -> str:
        """Start it; its address."""
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-c", "from service.cli import main; main()", "serve"],
                env=self._environment,
                stdout=subprocess.PIPE,
                stderr=log,
            )
        line = self._process.stdout.readline()
        assert line, self._log.read_text()
        return json.loads(line)["url"]

    def cut(self) -> None:
        """Kill it and everything that it started, at once."""
        top = psutil.Process(self._process.pid)
        family = [top, *top.children(recursive=True)]
        for process in family:
            process.send_signal(signal.SIGSTOP)
        for process in family:
            process.kill()
        self._process.wait()
        self._process.stdout.close()

    @property
    def pid(self) -> int:
        """Number of the service's process."""
        return self._process.pid

    def bury(self) -> None:
        """Take leave of a service that was killed, and wait for those that end with it."""
        self._process.wait(30)
        self._process.stdout.close()

    def end(self) -> None:
        """End it as a person does."""
        self._process.terminate()
        self._process.wait(30)
        self._process.stdout.close()

    def said(self) -> str:
        """What it found at its start."""
        events = [line for line in self._log.read_text().splitlines() if line.startswith("{")]
        found = [json.loads(line)["event"] for line in events]
        mark = "found at the start: "
        return "; ".join(line.removeprefix(mark) for line in found if line.startswith(mark))

    def rows(self, query: str) -> list[tuple]:
        """Look into the file."""
        with closing(sqlite3.connect(self.file, timeout=30)) as connection:
            return connection.execute(query).fetchall()

    def readings(self) -> dict[tuple[int, int], tuple]:
        """Readings by pose and repeat."""
        rows = self.rows("SELECT id, idx, repeat, joints, position FROM reading ORDER BY id")
        return {(row[1], row[2]): row for row in rows}

    def await_more_than(self, count: int) -> None:
        """Wait for the next reading."""
        wait_until(lambda: len(self.readings()) > count)


@contextmanager
def emulated(folder: Path, time_scale: float) -> Iterator[World]:
    """The cell, which has its own power."""
    with closing(World(folder, time_scale=time_scale)) as world:
        yield world


def run(count: int, folder: Path, time_scale: float = 6.0) -> Outcome:
    """Cut so often during one campaign."""
    rng = random.Random(SEED)
    poses = POSES_PER_CUT * (count + 1)
    site, cuts = Installation(folder), []
    with emulated(folder, time_scale) as world:
        begin_campaign(site.start(), world, poses)
        kept: dict[tuple[int, int], tuple] = {}
        changed = lost = 0
        for _ in range(count):
            before = len(site.readings())
            site.await_more_than(before)
            time.sleep(rng.uniform(0.0, 0.8))
            site.cut()
            now = site.readings()
            lost += len(set(kept) - set(now))
            changed += sum(now[visit] != row for visit, row in kept.items() if visit in now)
            kept = now
            began = time.monotonic()
            site.start()
            site.await_more_than(len(now))
            cuts.append(Cut(len(now), site.said(), time.monotonic() - began))
        world.ask("set", name="time_scale", value=100)
        wait_until(lambda: len(site.readings()) == poses, period_s=0.05)
        final = site.readings()
        lost += len(set(kept) - set(final))
        outcome = Outcome(
            cuts=cuts,
            poses=poses,
            lost=lost + poses - len(final),
            doubled=site.rows("SELECT count(*) FROM reading")[0][0] - len(final),
            changed=changed + sum(final[visit] != row for visit, row in kept.items()),
            wrong_pose=sum(not is_true(world, row) for row in final.values()),
            driven_again=site.rows("SELECT sum(attempt) FROM pose")[0][0] - poses,
            integrity=site.rows("PRAGMA integrity_check")[0][0],
        )
        site.end()
    return outcome


def begin_campaign(url: str, world: World, poses: int) -> None:
    with httpx.Client(base_url=f"{url}/api/v1", headers=BEARER, timeout=30) as client:
        devices = {"driver": "mock", "address": world.address}
        cell = {"name": "c1", "robot": {"model": "ur10e", **devices}, "tracker": devices}
        assert client.post("/cells", json=cell).status_code == 201
        assert client.post("/cells/c1/arm").status_code == 200
        body = {"cell": "c1", "kind": "calibrate", "poses": poses_about_start(poses)}
        answer = client.post("/campaigns", json=body | {"settle_s": 0.2})
        assert answer.status_code == 202, answer.text


def is_true(world: World, row: tuple) -> bool:
    truth = world.ask("truth", joints=json.loads(row[3]))["position"]
    return bool(np.linalg.norm(np.subtract(json.loads(row[4]), truth)) < NOISE)


def text(outcome: Outcome) -> str:
    """The figures as a table, and what was said at some of the starts."""
    back = sorted(cut.back_s for cut in outcome.cuts)
    rows = [
        ("power cuts during one campaign", str(len(outcome.cuts))),
        ("poses of the campaign", str(outcome.poses)),
        ("starts that said what they found", str(sum("campaign" in c.said for c in outcome.cuts))),
        ("readings lost", str(outcome.lost)),
        ("readings doubled", str(outcome.doubled)),
        ("readings changed", str(outcome.changed)),
        ("readings of another pose than they say", str(outcome.wrong_pose)),
        ("poses driven to again", str(outcome.driven_again)),
        ("the file's integrity check", outcome.integrity),
        (
            f"start to next reading, s (lease {LEASE_S:g} s): median, most",
            f"{back[len(back) // 2]:.1f}, {back[-1]:.1f}",
        ),
    ]
    said = [f"    {cut.said}" for cut in outcome.cuts[:3]]
    return "\n".join([table(("what", "count"), rows), "", *said])


def main() -> int:
    """Print the figures; exit status 1 if anything was lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cuts", type=int, default=50)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="robocal-cuts-") as folder:
        outcome = run(options.cuts, Path(folder))
    print(text(outcome))
    wrong = outcome.lost + outcome.doubled + outcome.changed + outcome.wrong_pose
    return 0 if wrong == 0 and outcome.integrity == "ok" else 1


if __name__ == "__main__":
    sys.exit(main())
