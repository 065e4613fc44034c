"""The main job on emulated hardware, through the same REST calls that a plant would make."""

import os
import signal
import statistics
import sys
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import httpx

from robocal.errors import NoAnswer
from service.access.secrets import new_key
from service.child_process import ChildProcess
from service.emulated_cell import CellAddresses, EmulatedCell
from service.parent import WITH_PARENT

ROBOT = "ur10e"
TIME_SCALE = 20.0
SEED = 7
SETTLE_S = 0.5
_POLL_S = 0.2
_LIMIT_S = 600.0
_INTERRUPTED = 128 + signal.SIGINT
"""Exit status of a program that a person stopped."""


class Progress:
    """One line that is written over on a terminal; in a file only what it said last."""

    def __init__(self, label: str) -> None:
        self._label = label
        self._said = ""

    def show(self, text: str) -> None:
        """Say where things stand."""
        if sys.stdout.isatty() and text != self._said:
            print(f"\r{self._label}: {text:50}", end="", flush=True)
        self._said = text

    def end(self) -> None:
        """Leave the last word standing."""
        print(
            f"\r{self._label}: {self._said:50}"
            if sys.stdout.isatty()
            else f"{self._label}: {self._said}"
        )


@dataclass(frozen=True)
class Service:
    """The running service, seen by a client."""

    client: httpx.Client
    url: str

    def post(self, path: str, **body: object) -> dict[str, Any]:
        """Ask for something; a refusal ends the demonstration with its sentence."""
        answer = self.client.post(f"/api/v1{path}", json=body)
        return _accepted(answer)

    def get(self, path: str) -> dict[str, Any]:
        """Read something."""
        return _accepted(self.client.get(f"/api/v1{path}"))

    def follow(self, campaign: int, label: str) -> None:
        """Show the progress of a campaign until it ends."""
        ends = time.monotonic() + _LIMIT_S
        progress = Progress(label)
        while time.monotonic() < ends:
            seen = self.get(f"/campaigns/{campaign}")
            progress.show(f"{seen['done']} of {seen['total']} readings, {seen['state']}")
            if seen["state"] == "finished":
                progress.end()
                return
            if seen["state"] in ("paused", "aborted", "failed"):
                progress.end()
                raise NoAnswer(f"{label} {seen['state']}: {seen['reason']}")
            time.sleep(_POLL_S)
        raise NoAnswer(f"{label} did not end within {_LIMIT_S:.0f} s")


def run_demo(poses: int, targets: int, *, once: bool) -> None:
    """Start emulators, service and worker; calibrate, verify, print; stay unless `once`."""
    # Ended from outside, it ends what it started too.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        _run(poses, targets, once=once)
    except KeyboardInterrupt:
        print("\nstopped before the end")
        sys.exit(_INTERRUPTED)


def _run(poses: int, targets: int, *, once: bool) -> None:
    with ExitStack() as stack:
        folder = Path(stack.enter_context(TemporaryDirectory()))
        print(
            f"emulated {ROBOT} and tracker; the world's clock runs {TIME_SCALE:g} times real time"
        )
        cell = stack.enter_context(EmulatedCell(ROBOT, TIME_SCALE, SEED))
        if cell.note:
            print(cell.note)
        service = _start_service(stack, folder)
        print(f"service at {service.url}", flush=True)
        _calibrate(service, cell, poses)
        _verify(service, targets)
        print(f"\npage: {service.url}", flush=True)
        if not once:
            print("Ctrl+C ends it")
            _stay()


def _start_service(stack: ExitStack, folder: Path) -> Service:
    key = new_key()
    environment = {
        **os.environ,
        "ROBOCAL_BOOTSTRAP_KEY": key,
        # Lines of progress are what a person wants to see here.
        "ROBOCAL_LOG_LEVEL": "WARNING",
        "ROBOCAL_DATABASE_URL": f"sqlite:///{folder / 'demo.sqlite3'}",
        "ROBOCAL_PORT": os.environ.get("ROBOCAL_PORT", "0"),
    }
    web = ChildProcess("service.main", WITH_PARENT, environment=environment)
    stack.callback(web.close)
    url = str(web.ready()["url"])
    worker = ChildProcess("service.jobs.worker", WITH_PARENT, environment=environment)
    stack.callback(worker.close)
    worker.ready()
    bearer = {"Authorization": f"Bearer {key}"}
    client = stack.enter_context(httpx.Client(base_url=url, headers=bearer, timeout=30.0))
    return Service(client, url)


def _calibrate(service: Service, cell: CellAddresses, poses: int) -> None:
    service.post(
        "/cells",
        name="demo",
        robot={"model": ROBOT, "driver": cell.robot.driver, "address": cell.robot.address},
        tracker={"driver": cell.tracker.driver, "address": cell.tracker.address},
    )
    campaign = _drive(service, "calibrate", poses, "calibration")
    result = _result(service, f"/campaigns/{campaign}/identification")
    _result(service, f"/campaigns/{campaign}/uncertainty")
    residuals = result["residuals"]
    print(f"identified {result['rank']} parameters by the {result['strategy']} strategy")
    print(f"{'position error on held-out poses, mm':42}{'RMS':>8}{'mean':>8}{'max':>8}")
    _row("  nominal geometry, frames fitted", residuals["before"])
    _row("  identified geometry", residuals["held_out"])


def _verify(service: Service, targets: int) -> None:
    campaign = _drive(service, "verify", targets, "verification")
    result = _result(service, f"/campaigns/{campaign}/verification")
    print(f"{f'{targets} other targets, driven to and measured, mm':42}")
    _row("  nominal joints", result["before"])
    _row("  compensated joints", result["after"])
    _print_times(service.get(f"/campaigns/{campaign}/measurements")["rows"])


def _drive(service: Service, kind: str, poses: int, label: str) -> int:
    service.post("/cells/demo/arm")
    campaign = service.post(
        "/campaigns", cell="demo", kind=kind, poses=poses, settle_s=SETTLE_S, seed=SEED
    )
    service.follow(campaign["id"], label)
    return int(campaign["id"])


def _result(service: Service, path: str) -> dict[str, Any]:
    """Wait for a result that the queue is still computing."""
    ends = time.monotonic() + _LIMIT_S
    while time.monotonic() < ends:
        answer = service.client.get(f"/api/v1{path}")
        if answer.status_code == httpx.codes.OK:
            document: dict[str, Any] = answer.json()
            return document
        if answer.status_code != httpx.codes.NOT_FOUND:
            _accepted(answer)
        time.sleep(_POLL_S)
    raise NoAnswer(f"{path} was not computed within {_LIMIT_S:.0f} s")


def _accepted(answer: httpx.Response) -> dict[str, Any]:
    document: dict[str, Any] = answer.json()
    if answer.is_error:
        raise NoAnswer(f"the service refused {answer.request.url.path}: {document.get('detail')}")
    return document


def _row(name: str, summary: dict[str, float]) -> None:
    values = (summary[f"position_{which}_mm"] for which in ("rms", "mean", "max"))
    print(f"{name:42}" + "".join(f"{value:8.4f}" for value in values))


def _print_times(readings: list[dict[str, Any]]) -> None:
    """Median seconds of a pose, as the robot's clock and ours saw them."""
    parts = {
        part: statistics.median(float(reading[f"{part}_s"]) for reading in readings)
        for part in ("motion", "settling", "measuring", "overhead")
    }
    shown = ", ".join(f"{part} {seconds:.3f} s" for part, seconds in parts.items())
    print(f"time per pose (median): {shown}")


def _stay() -> None:
    try:
        while True:
            time.sleep(3600)
    except KeyboardInterrupt:
        print()
