"""How soon the arm stands still: `python -m tests.studies.stops [--moments 200] [--kind ...]`.

`robocal serve` drives an emulated UR10e over RTDE, the world's clock running as ours does. At a
random moment of a motion something is killed, frozen, cut off or aborted; from then to standstill
is read at the world's clock. Afterwards the arm is watched while the loss lasts: it must not move.
"""

from __future__ import annotations

import argparse
import random
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np
import psutil

from tests.benchmarks.report import table
from tests.credentials import BEARER
from tests.integration.service_cell import wait_until
from tests.integration.ur_cell import Cell, emulated_cell
from tests.studies.power_cuts import Installation

LIMIT_S = 0.3
ALL = "100.0%"
SPEEDS_DEG_S = (30.0, 90.0)
"""The default, and the fastest that a cell may have."""
WATCHED_S = 0.4
"""So long the arm is watched after it came to rest, with the loss still there."""
POSES = [
    {f"j{joint}_deg": sign * 150.0 if joint == 1 else -45.0 for joint in range(1, 7)}
    for sign in (1, -1)
] * 40


@dataclass
class Rig:
    """A served cell whose campaign swings the arm to and fro."""

    site: Installation
    cell: Cell
    client: httpx.Client
    speed_deg_s: float
    rng: random.Random
    campaign: int = 0

    def keep_moving(self) -> None:
        """Wait for a motion at full speed, starting or resuming a campaign where none runs."""
        deadline = time.monotonic() + 60
        while not self.cell.world.moving():
            assert time.monotonic() < deadline, "the campaign does not go on"
            self._go_on()
            time.sleep(0.05)
        begun = self.cell.world.joints()[0]
        wait_until(
            lambda: abs(self.cell.world.joints()[0] - begun) > 0.7 or self.cell.world.at_rest(), 10
        )
        time.sleep(self.rng.uniform(0.0, 1.2))

    def _go_on(self) -> None:
        state = self.ask("get", f"/campaigns/{self.campaign}")["state"] if self.campaign else "none"
        if state == "paused":
            self.ask("post", "/cells/c1/arm")
            self.ask("post", f"/campaigns/{self.campaign}/resume")
        elif state in {"none", "aborted", "failed", "finished"}:
            self.ask("post", "/cells/c1/arm")
            body = {"cell": "c1", "kind": "calibrate", "poses": POSES, "settle_s": 0.0}
            self.campaign = self.ask("post", "/campaigns", json=body)["id"]

    def ask(self, method: str, path: str, **more: object) -> dict:
        answer = self.client.request(method, path, **more)
        assert answer.status_code < 300 or answer.status_code == 409, answer.text
        return answer.json()

    def serve(self) -> None:
        """Start the service and its worker."""
        self.client.base_url = f"{self.site.start()}/api/v1"

    def process(self, mark: str) -> psutil.Process:
        """The service, or its descendant whose command line has this word."""
        own = psutil.Process(self.site.pid)
        if not mark:
            return own
        found = [p for p in own.children(recursive=True) if mark in " ".join(p.cmdline())]
        assert len(found) == 1, (mark, found)
        return found[0]


@dataclass
class Loss:
    """One way to lose control: how it begins, and how it is over."""

    begin: Callable[[Rig, psutil.Process], object]
    end: Callable[[Rig, psutil.Process], object] = lambda rig, process: None
    process: str = ""
    """Word in the command line of the process that it is about; the service's own if empty."""


def serve_again(rig: Rig, service: psutil.Process) -> None:
    """Start the service anew after it was killed."""
    rig.site.bury()
    rig.serve()


WORKER, CHILD = "service.jobs.worker", "ur_rtde"
LOSSES: dict[str, Loss] = {
    "abort over REST": Loss(lambda rig, _: rig.ask("post", f"/campaigns/{rig.campaign}/abort")),
    "kill -9 of the driver's child": Loss(lambda _, child: child.kill(), process=CHILD),
    "kill -9 of the worker": Loss(lambda _, worker: worker.kill(), process=WORKER),
    "kill -9 of the service": Loss(lambda _, service: service.kill(), serve_again),
    "worker frozen (SIGSTOP)": Loss(
        lambda _, worker: worker.send_signal(signal.SIGSTOP),
        lambda _, worker: worker.send_signal(signal.SIGCONT),
        WORKER,
    ),
    "network lost": Loss(
        lambda rig, _: rig.cell.controller.order(fault="silent", on=True),
        lambda rig, _: rig.cell.controller.order(fault="silent", on=False),
    ),
}


@dataclass
class Times:
    """What was measured of one loss."""

    seconds: list[float] = field(default_factory=list)
    moved_again: int = 0


def measure(rig: Rig, loss: Loss, times: Times) -> None:
    """Lose control once; a motion that ended by itself just then does not count."""
    rig.keep_moving()
    if rig.cell.world.at_rest():
        return
    process = rig.process(loss.process)
    since_s = rig.cell.world.ask("robot")["time_s"]
    loss.begin(rig, process)
    wait_until(rig.cell.world.at_rest, 10, 0.002)
    times.seconds.append(rig.cell.world.ask("robot")["time_s"] - since_s)
    resting = rig.cell.world.joints()
    until = time.monotonic() + WATCHED_S
    while time.monotonic() < until:
        if rig.cell.world.joints() != resting:
            times.moved_again += 1
            break
        time.sleep(0.02)
    loss.end(rig, process)


def main() -> int:
    """Print the table; exit status 1 if a stop took too long or an arm moved again."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--moments", type=int, default=200)
    parser.add_argument("--kind", nargs="*", choices=list(LOSSES), default=list(LOSSES))
    parser.add_argument("--seed", type=int, default=time.time_ns() % 2**31)
    parser.add_argument("--speed", type=float, nargs="*", default=list(SPEEDS_DEG_S))
    options = parser.parse_args()
    rows = []
    for speed in options.speed:
        with tempfile.TemporaryDirectory(prefix="robocal-stops-") as folder, ExitStack() as stack:
            rig = started(stack, Path(folder), speed, random.Random(options.seed))
            for kind in options.kind:
                times = Times()
                while len(times.seconds) < options.moments:
                    measure(rig, LOSSES[kind], times)
                rows.append(row(kind, speed, times))
                print("  ".join(rows[-1]), file=sys.stderr, flush=True)
    head = ("what", "deg/s", "moments", "median s", "95 % s", "most s", "within 0.3 s")
    head = (*head, "moved again")
    print(f"seed {options.seed}\n{table(head, rows)}")
    return int(any((cells[6], cells[7]) != (ALL, "0") for cells in rows))


def started(stack: ExitStack, folder: Path, speed: float, rng: random.Random) -> Rig:
    """Start cell, service and worker, and describe the one to the other."""
    cell = stack.enter_context(emulated_cell(folder, number=5, time_scale=1.0))
    site = Installation(folder)
    client = stack.enter_context(httpx.Client(headers=BEARER, timeout=30))
    rig = Rig(site, cell, client, speed, rng)
    rig.serve()
    stack.callback(site.end)
    described = {
        "name": "c1",
        "robot": {"model": "ur10e", "driver": "ur_rtde", "address": cell.address},
        "tracker": {"driver": "mock", "address": cell.world.address},
        "limits": {"speed_deg_s": speed},
    }
    assert client.post("/cells", json=described).status_code == 201
    return rig


def row(kind: str, speed: float, times: Times) -> tuple[str, ...]:
    """One line of the table."""
    seconds = np.array(times.seconds)
    figures = (np.median(seconds), np.quantile(seconds, 0.95), seconds.max())
    return (
        kind,
        f"{speed:.0f}",
        str(len(seconds)),
        *(f"{value:.3f}" for value in figures),
        f"{np.mean(seconds <= LIMIT_S):.1%}",
        str(times.moved_again),
    )


if __name__ == "__main__":
    sys.exit(main())
