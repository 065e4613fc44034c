"""A day of campaigns in compressed time: `python -m tests.studies.soak [--hours 24]`.

`robocal serve` drives two emulated cells over real wires (RTDE with GeoCOM, Modbus with NDI, a
temperature probe each), whose clocks run a hundred times as fast as ours: calibration after
calibration with all that is computed of it. Memory, open files, threads and children of service
and worker are sampled all the time; in the end whatever was started must be gone.
"""

from __future__ import annotations

import argparse
import os
import socket
import sys
import tempfile
import time
import uuid
from collections import Counter
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np
import psutil

from service.emulated_cell import CellAddresses, EmulatedCell, Wires
from service.world_client import WorldClient
from tests.benchmarks.report import table
from tests.credentials import BEARER
from tests.studies.power_cuts import Installation

TIME_SCALE = 100.0
POSES = 20
WIRES = {
    "c1": ("ur10e", Wires("ur_rtde", "geocom", "modbus_temperature")),
    "c2": ("abb_irb120", Wires("modbus", "ndi", "modbus_temperature")),
}
"""Robot and wires by cell."""
GROWTH, SLACK = 1.05, 4
"""More growth than this from the first quarter to the last is not flat: of memory, and of counts.

The pool of database connections fills when requests happen to meet, two files for each.
"""
WARM_CAMPAIGNS = 4
"""Not sampled: whatever is loaded once is loaded then."""
LOOK_S = 0.5
LONGEST_S = 600.0
"""Of one campaign, real time [s]."""
MARK = "ROBOCAL_SOAK"
WORKER = "service.jobs.worker"
QUANTITIES = ("memory, MB", "open files", "threads", "children")


@dataclass
class Soak:
    """What runs, what was counted, and samples by process: one row of `QUANTITIES` a look."""

    site: Installation
    client: httpx.Client
    cells: dict[str, CellAddresses]
    worlds: dict[str, WorldClient]
    states: Counter[str] = field(default_factory=Counter)
    sentences: list[str] = field(default_factory=list)
    readings: int = 0
    samples: dict[str, list[tuple[float, ...]]] = field(
        default_factory=lambda: {"service": [], "worker": []}
    )

    @property
    def hours(self) -> float:
        """What the cells' clock has gone since its start [h]."""
        asked = (world.ask("robot")["time_s"] for world in self.worlds.values())
        return min(float(time_s) for time_s in asked) / 3600

    def campaign(self, cell: str) -> None:
        """Drive one calibration to the end of its computations."""
        self.accepted("post", f"/cells/{cell}/arm")
        body = {"cell": cell, "kind": "calibrate", "poses": POSES, "settle_s": 0.5}
        number = self.accepted("post", "/campaigns", json=body)["id"]
        deadline = time.monotonic() + LONGEST_S
        while (seen := self.accepted("get", f"/campaigns/{number}"))["state"] != "finished":
            if seen["state"] in {"failed", "aborted"} or time.monotonic() > deadline:
                break
            if seen["state"] == "paused":
                self.sentences.append(seen["reason"])
                self.accepted("post", f"/cells/{cell}/arm")
                self.accepted("post", f"/campaigns/{number}/resume")
            self.look()
            time.sleep(LOOK_S)
        self.states[seen["state"]] += 1
        self.readings += seen["done"]

    def look(self) -> None:
        """Sample both processes, once all is loaded."""
        if self.states.total() < WARM_CAMPAIGNS:
            return
        own = psutil.Process(self.site.pid)
        (worker,) = filter(is_worker, own.children())
        for name, process in (("service", own), ("worker", worker)):
            megabytes = process.memory_info().rss / 1e6
            below = len(process.children())
            self.samples[name].append((megabytes, process.num_fds(), process.num_threads(), below))

    def accepted(self, method: str, path: str, **more: object) -> dict:
        """Ask the service."""
        answer = self.client.request(method, path, **more)
        assert answer.is_success, f"{path}: {answer.text}"
        return answer.json()


def is_worker(process: psutil.Process) -> bool:
    """Whether a child of the service is the worker; one that is just ending is not."""
    try:
        return WORKER in " ".join(process.cmdline())
    except psutil.Error:
        return False


def started(stack: ExitStack, folder: Path) -> Soak:
    """Start cells and service, and describe the one to the other."""
    cells = {
        name: stack.enter_context(EmulatedCell(robot, TIME_SCALE, number, (), wires))
        for number, (name, (robot, wires)) in enumerate(WIRES.items())
    }
    site = Installation(folder)
    client = stack.enter_context(httpx.Client(headers=BEARER, timeout=60))
    client.base_url = f"{site.start()}/api/v1"
    stack.callback(site.end)
    worlds = {
        name: stack.enter_context(closing(WorldClient(cell.world))) for name, cell in cells.items()
    }
    soak = Soak(site, client, cells, worlds)
    for name, cell in cells.items():
        parts = {"tracker": cell.tracker, "temperature_probe": cell.probe}
        places = {k: {"driver": w.driver, "address": w.address} for k, w in parts.items()}
        robot = {"driver": cell.robot.driver, "address": cell.robot.address}
        robot["model"] = WIRES[name][0]
        soak.accepted("post", "/cells", json={"name": name, "robot": robot, **places})
    return soak


def family(mark: str) -> dict[int, str]:
    """Commands of the processes with this mark in their environment, but for this one."""
    found = {}
    for process in psutil.process_iter():
        try:
            if process.pid != os.getpid() and process.environ().get(MARK) == mark:
                found[process.pid] = " ".join(process.cmdline())
        except (psutil.Error, OSError):
            continue
    return found


def places_of(mark: str) -> tuple[set[tuple[str, int]], set[str]]:
    """Listening ports and pseudo-terminals that these processes have open."""
    ports, terminals = set(), set()
    for pid in family(mark):
        try:
            held = psutil.Process(pid)
            ports |= {
                tuple(c.laddr)
                for c in held.net_connections("tcp")
                if c.status == psutil.CONN_LISTEN
            }
            links = (os.readlink(entry.path) for entry in os.scandir(f"/proc/{pid}/fd"))
            terminals |= {link for link in links if link.startswith("/dev/pts/")}
        except (psutil.Error, OSError):
            continue
    return ports, terminals


def answers(place: tuple[str, int]) -> bool:
    """Whether somebody listens there."""
    with socket.socket() as probe:
        return probe.connect_ex(place) == 0


def main() -> int:
    """Print the tables; exit status 1 if memory grew or anything was left."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--hours", type=float, default=24.0, help="of the cells' clock")
    options = parser.parse_args()
    mark, began_s = str(uuid.uuid4()), time.monotonic()
    os.environ[MARK] = mark
    with tempfile.TemporaryDirectory(prefix="robocal-soak-") as name:
        here, scratch = Path(name), Path(name) / "tmp"
        scratch.mkdir()
        os.environ["TMPDIR"] = tempfile.tempdir = str(scratch)
        with ExitStack() as stack:
            soak = started(stack, here)
            ports, terminals = places_of(mark)
            while soak.hours < options.hours:
                for cell in WIRES:
                    soak.campaign(cell)
                print(f"{soak.hours:.1f} h, {dict(soak.states)}", file=sys.stderr, flush=True)
            hours, megabytes = soak.hours, soak.site.file.stat().st_size / 1e6
        still = family(mark)
        for command in still.values():
            print(f"left: {command}")
        left = {
            "processes left": len(still),
            "ports left open": sum(map(answers, ports)),
            "pseudo-terminals left": sum(map(os.path.exists, terminals)),
            "temporary files left": len(list(scratch.rglob("*"))),
        }
    minutes = (time.monotonic() - began_s) / 60
    return printed(soak, hours, minutes, megabytes, left)


def printed(
    soak: Soak, hours: float, minutes: float, megabytes: float, left: dict[str, int]
) -> int:
    """Print what was found; 0 where all is as it should be."""
    ends = ", ".join(f"{count} {state}" for state, count in soak.states.items())
    rows = [
        ("hours on the cells' clock", f"{hours:.1f}"),
        ("minutes on ours", f"{minutes:.1f}"),
        ("campaigns", ends),
        ("readings", str(soak.readings)),
        ("times that a campaign asked for a person", str(len(soak.sentences))),
        ("database in the end, MB", f"{megabytes:.1f}"),
        *((what, str(count)) for what, count in left.items()),
    ]
    print(table(("what", "count"), rows), end="\n\n")
    flat, quarters = True, []
    for process, samples in soak.samples.items():
        values = np.array(samples)
        quarter = max(len(values) // 4, 1)
        first, last = np.median(values[:quarter], axis=0), np.median(values[-quarter:], axis=0)
        flat &= bool(last[0] <= GROWTH * first[0] and np.all(last[1:] <= first[1:] + SLACK))
        for what, a, b, most in zip(QUANTITIES, first, last, values.max(axis=0), strict=True):
            quarters.append((f"{process}: {what}", f"{a:.1f}", f"{b:.1f}", f"{most:.1f}"))
    print(table(("median of", "first quarter", "last quarter", "most"), quarters))
    for sentence in dict.fromkeys(soak.sentences):
        print(f"    {sentence}")
    sound = flat and not any(left.values()) and set(soak.states) == {"finished"}
    return 0 if sound else 1


if __name__ == "__main__":
    sys.exit(main())
