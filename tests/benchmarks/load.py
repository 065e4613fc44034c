"""The service under load: an MES that reads parameters, live pages, and a campaign on its way.

The load comes from a process of its own that sends on a fixed schedule and counts every answer's
delay from the moment when it was due, so that a service that falls behind cannot hide it.
"""

import asyncio
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import psutil

from service.db.engine import open_database
from service.db.models import ParametersRow
from tests.benchmarks.report import Goal, table
from tests.credentials import BEARER, KEY, SETTING
from tests.integration.service_cell import (
    Site,
    emulated_world,
    installation,
    poses_about_start,
)

READS_PER_S = 300
PAGES = 50
SECONDS = 20.0
CONNECTIONS = 16
P99_MS = 100.0
GIVEN_UP_S = 5.0
MORE_OVERHEAD_S = 0.01
"""As good as unchanged: a twentieth of the shortest visit [s]."""
POSES = 40
PARAMETERS = 30
"""As many as a six-joint robot's identification stores, each with its covariance row."""


@dataclass(frozen=True)
class Delays:
    """Delays of the reads [s]."""

    seconds: list[float]
    not_modified: int

    def quantile(self, share: float) -> float:
        """Delay that this share of the reads does not exceed [ms]."""
        ordered = sorted(self.seconds)
        return 1e3 * ordered[min(int(share * len(ordered)), len(ordered) - 1)]


async def _answer(reader: asyncio.StreamReader) -> tuple[int, dict[str, str]]:
    head = (await reader.readuntil(b"\r\n\r\n")).decode()
    first, *lines = head.split("\r\n")
    headers = {k.lower(): v.strip() for k, _, v in (line.partition(":") for line in lines if line)}
    await reader.readexactly(int(headers.get("content-length", 0)))
    return int(first.split()[1]), headers


async def _reader(host: str, port: int, path: str, due: "asyncio.Queue[float]") -> Delays:
    """One connection that sends a read when it is due, with the tag of its last answer."""
    reader, writer = await asyncio.open_connection(host, port)
    delays, known, tag = [], 0, ""
    while (moment := await due.get()) > 0:
        if time.monotonic() - moment > GIVEN_UP_S:
            # Hopelessly behind: the delay counts, the read is not sent.
            delays.append(time.monotonic() - moment)
            continue
        lines = [f"GET {path} HTTP/1.1", f"Host: {host}:{port}"]
        lines += [f"{name}: {value}" for name, value in BEARER.items()]
        # Half of the reads are an MES's that has just started and knows no tag.
        if tag and len(delays) % 2:
            lines.append(f"If-None-Match: {tag}")
        writer.write(("\r\n".join(lines) + "\r\n\r\n").encode())
        status, headers = await _answer(reader)
        assert status in {200, 304}, status
        known += status == 304
        tag = headers["etag"]
        delays.append(time.monotonic() - moment)
    writer.close()
    return Delays(delays, known)


async def _page(host: str, port: int, path: str, shown: asyncio.Semaphore) -> int:
    """One live page; the number of events that it got until it was closed."""
    reader, writer = await asyncio.open_connection(host, port)
    credentials = "".join(f"{name}: {value}\r\n" for name, value in BEARER.items())
    writer.write(f"GET {path} HTTP/1.1\r\nHost: {host}:{port}\r\n{credentials}\r\n".encode())
    events = 0
    try:
        while line := await reader.readline():
            if line.startswith(b"event:"):
                events += 1
                if events == 1:
                    shown.release()
    finally:
        writer.close()
    return events


async def _send(url: str, cell: str, campaign: int) -> dict[str, object]:
    """Pages first, then reads on schedule."""
    host, port = urlsplit(url).hostname or "", urlsplit(url).port or 0
    events = f"/api/v1/campaigns/{campaign}/events"
    shown = asyncio.Semaphore(0)
    pages = [asyncio.create_task(_page(host, port, events, shown)) for _ in range(PAGES)]
    for _ in pages:
        # Open pages are the load, not their opening.
        await shown.acquire()
    due: asyncio.Queue[float] = asyncio.Queue()
    path = f"/api/v1/cells/{cell}/parameters"
    readers = [asyncio.create_task(_reader(host, port, path, due)) for _ in range(CONNECTIONS)]
    began = time.monotonic()
    for number in range(int(READS_PER_S * SECONDS)):
        moment = began + number / READS_PER_S
        await asyncio.sleep(max(moment - time.monotonic(), 0.0))
        due.put_nowait(moment)
    for _ in readers:
        due.put_nowait(0.0)
    found = await asyncio.gather(*readers)
    took = time.monotonic() - began
    for page in pages:
        page.cancel()
    await asyncio.gather(*pages, return_exceptions=True)
    return {
        "delays": [delay for one in found for delay in one.seconds],
        "not_modified": sum(one.not_modified for one in found),
        "seconds": took,
    }


def _release_parameters(site: Site, cell: str) -> None:
    """A version of usual size, as a finished calibration leaves it."""
    row = {"name": "theta_1", "unit": "deg", "nominal": 0.0, "identified": 0.01, "std": 1e-4}
    row |= {"status": "identified", "reason": ""}
    content = {
        "parameters": [row | {"name": f"p{n}"} for n in range(PARAMETERS)],
        "base": {},
        "tool": {},
        "residuals": {},
        "uncertainty": {"covariance": [[1e-9 * (i + j) for i in range(30)] for j in range(30)]},
        "model": {"joints": [[0.1] * 5] * 6},
        "provenance": {
            "campaign": 1,
            "bundle_sha256": "0" * 64,
            "software_version": "0",
            "computed": "2026-01-01T00:00:00+00:00",
        },
    }
    database = open_database(site.database_url)
    with database.write() as session:
        session.add(
            ParametersRow(
                cell=cell,
                version=1,
                state="released",
                document=content,
                campaign=1,
                created="2026-01-01T00:00:00+00:00",
                released="2026-01-01T00:00:00+00:00",
            )
        )
    database.close()


def _overhead(site: Site, campaign: int) -> float:
    rows = site.rows(f"SELECT overhead_s FROM reading WHERE campaign = {campaign} ORDER BY id")
    return statistics.median(row[0] for row in rows[1:])


def _campaign(site: Site, poses: int) -> int:
    site.post("/cells/c1/arm")
    return site.start_campaign(poses_about_start(poses))


def _loaded(site: Site, campaign: int) -> dict[str, object]:
    command = [
        sys.executable,
        "-m",
        "tests.benchmarks.load",
        site.service.ready["url"],
        str(campaign),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    answer: dict[str, object] = json.loads(done.stdout)
    return answer


def run() -> tuple[str, list[Goal]]:
    """Without load, then with it."""
    os.environ.setdefault(SETTING, KEY)
    with (
        tempfile.TemporaryDirectory(prefix="robocal-load-") as name,
        emulated_world(Path(name), time_scale=4) as world,
        installation(Path(name), lease_s=10.0, idle_s=0.3, events_poll_s=0.2) as site,
    ):
        site.make_cell(world)
        quiet = _campaign(site, POSES)
        site.await_done(quiet, POSES, 120)
        _release_parameters(site, "c1")
        busy = _campaign(site, 400)
        site.await_done(busy, 2)
        service = psutil.Process(site.service.process.pid)
        before = service.cpu_times()
        answer = _loaded(site, busy)
        after = service.cpu_times()
        site.post(f"/campaigns/{busy}/abort")
        overheads = _overhead(site, quiet), _overhead(site, busy)
    cpu = after.user + after.system - before.user - before.system
    return _shown(answer, cpu, *overheads)


def _shown(
    answer: dict[str, object], cpu_s: float, quiet_s: float, busy_s: float
) -> tuple[str, list[Goal]]:
    delays = Delays(list(answer["delays"]), int(answer["not_modified"]))
    rate = len(delays.seconds) / float(answer["seconds"])
    p99 = delays.quantile(0.99)
    rows = [
        ("reads of parameters a second", f"{rate:.0f}"),
        ("of these answered 304", f"{delays.not_modified / len(delays.seconds):.0%}"),
        ("live pages", str(PAGES)),
        ("delay of a read, median, ms", f"{delays.quantile(0.5):.1f}"),
        ("delay of a read, p99, ms", f"{p99:.1f}"),
        ("CPU of the service, cores", f"{cpu_s / float(answer['seconds']):.2f}"),
        ("overhead per pose without load, median, ms", f"{1e3 * quiet_s:.1f}"),
        ("overhead per pose under load, median, ms", f"{1e3 * busy_s:.1f}"),
    ]
    goals = [
        Goal("reads a second", f"{rate:.0f}", f">= {0.99 * READS_PER_S:.0f}", rate >= 297.0),
        Goal("p99 of a read", f"{p99:.1f} ms", f"<= {P99_MS:.0f} ms", p99 <= P99_MS),
        Goal(
            "more overhead per pose",
            f"{1e3 * (busy_s - quiet_s):.1f} ms",
            f"<= {1e3 * MORE_OVERHEAD_S:.0f} ms",
            busy_s - quiet_s <= MORE_OVERHEAD_S,
        ),
    ]
    return f"## Load\n\n{table(('what', 'figure'), rows)}\n", goals


if __name__ == "__main__":
    json.dump(asyncio.run(_send(sys.argv[1], "c1", int(sys.argv[2]))), sys.stdout)
