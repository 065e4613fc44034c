"""Many campaigns on many cells: `python -m tests.studies.many_cells [--campaigns 300]`.

Emulated cells, one PostgreSQL, several workers as if on several hosts, one of which is killed now
and then and replaced. Asked of the database and of the cells in the end: is every reading there
once, and did a cell ever serve two campaigns at a time?
"""

import argparse
import os
import random
import sys
import tempfile
import time
from collections import Counter
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tests.benchmarks.report import table
from tests.integration.service_cell import (
    Site,
    World,
    emulated_world,
    installation,
    poses_about_start,
    wait_until,
)
from tests.postgresql import address, new_database, running_server

os.environ.setdefault("ROBOCAL_BOOTSTRAP_KEY", "key-of-the-tests-0123456789-0123456789")

POSES = 4
NOISE = 2e-4
"""Ten times the scatter of instrument and robot [m]"""
TIME_SCALE = 60
SEED = 7
LONGEST_S = 3600.0


@dataclass(frozen=True)
class Outcome:
    """What the database holds in the end, against what it should."""

    cells: int
    campaigns: int
    workers: int
    killed: int
    seconds: float
    asked: list[str]
    """What campaigns asked a person for."""
    missing: int
    doubled: int
    wrong_pose: int
    mixed: int
    """Readings of a campaign between two of another on the same cell."""
    driven_again: int
    unfinished: int


class Plant:
    """Cells with their worlds, and a queue of campaigns for each."""

    def __init__(self, site: Site, worlds: dict[str, World], campaigns: int) -> None:
        self.site = site
        self.worlds = worlds
        self.asked: list[str] = []
        self._left = {
            name: campaigns // len(worlds) + (number < campaigns % len(worlds))
            for number, name in enumerate(worlds)
        }
        self._current: dict[str, int | None] = dict.fromkeys(worlds)
        for name, world in worlds.items():
            site.make_cell(world, name, armed=False)

    def attend(self, name: str) -> bool:
        """Start a cell's next campaign if its last one has all readings; whether one is on."""
        number = self._current[name]
        if number is not None and self.site.get(f"/cells/{name}").json()["armed"]:
            # The cell is disarmed when its campaign has let go of the devices.
            found = self.site.campaign(number)
            if found["state"] == "paused":
                self.asked.append(f"campaign {number}: {found['reason']}")
                self.site.post(f"/campaigns/{number}/resume")
            return True
        if number is not None:
            # Four poses identify no robot: the numbers would only keep the cores busy.
            self.site.post(f"/campaigns/{number}/abort")
        self._current[name] = None
        if self._left[name]:
            self._left[name] -= 1
            self.site.post(f"/cells/{name}/arm")
            self._current[name] = self.site.start_campaign(poses_about_start(POSES), name)
        return self._current[name] is not None


def run(campaigns: int, cells: int, workers: int, kill_every: int, url: str) -> Outcome:
    """Drive all campaigns."""
    rng, killed = random.Random(SEED), 0
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="robocal-cells-")))
        worlds = {}
        for number in range(cells):
            place = folder / f"w{number}"
            place.mkdir()
            world = emulated_world(place, time_scale=TIME_SCALE, seed=number + 1)
            worlds[f"c{number}"] = stack.enter_context(world)
        site = stack.enter_context(installation(folder, workers=0, database_url=url, lease_s=5.0))
        crew = [site.start_worker() for _ in range(workers)]
        plant = Plant(site, worlds, campaigns)
        began = time.monotonic()
        busy = True
        while busy and time.monotonic() - began < LONGEST_S:
            busy = False
            for name in worlds:
                busy |= plant.attend(name)
                # By readings, not by time: so many deaths meet a fast machine as a slow one.
                if kill_every and stored_readings(site) >= kill_every * (killed + 1):
                    victim = rng.randrange(workers)
                    crew[victim].kill()
                    crew[victim] = site.start_worker()
                    killed += 1
            time.sleep(0.1)
        seconds = time.monotonic() - began
        open_jobs = "SELECT count(*) FROM job WHERE state IN ('queued', 'running', 'held')"
        wait_until(lambda: site.rows(open_jobs) == [(0,)], LONGEST_S, 0.5)
        known = Outcome(cells, campaigns, workers, killed, seconds, plant.asked, *[0] * 6)
        return judged(site, worlds, known)


def stored_readings(site: Site) -> int:
    """How many readings the database holds."""
    return int(site.rows("SELECT count(*) FROM reading")[0][0])


def judged(site: Site, worlds: dict[str, World], known: Outcome) -> Outcome:
    """Count what is wrong."""
    rows = site.rows(
        "SELECT c.cell, r.campaign, r.idx, r.joints, r.position FROM reading r "
        "JOIN campaign c ON c.id = r.campaign ORDER BY r.id"
    )
    visits = Counter((row[1], row[2]) for row in rows)
    wrong = mixed = 0
    order: dict[str, list[int]] = {}
    for cell, campaign, _, joints, position in rows:
        truth = worlds[cell].ask("truth", joints=joints)["position"]
        wrong += bool(np.linalg.norm(np.subtract(position, truth)) > NOISE)
        seen = order.setdefault(cell, [])
        if not seen or seen[-1] != campaign:
            mixed += campaign in seen
            seen.append(campaign)
    attempts = site.rows("SELECT sum(attempt) FROM pose")[0][0]
    ended = site.rows(
        "SELECT count(*) FROM campaign WHERE state IN ('finished', 'failed', 'aborted')"
    )[0][0]
    return Outcome(
        known.cells,
        known.campaigns,
        known.workers,
        known.killed,
        known.seconds,
        known.asked,
        missing=known.campaigns * POSES - len(visits),
        doubled=len(rows) - len(visits),
        wrong_pose=wrong,
        mixed=mixed,
        driven_again=attempts - len(rows),
        unfinished=known.campaigns - ended,
    )


def text(outcome: Outcome) -> str:
    """The figures as a table."""
    rows = [
        ("cells", outcome.cells),
        ("campaigns", outcome.campaigns),
        ("readings wanted", outcome.campaigns * POSES),
        ("workers", outcome.workers),
        ("workers killed and replaced", outcome.killed),
        ("readings missing", outcome.missing),
        ("readings doubled", outcome.doubled),
        ("readings of another pose than they say", outcome.wrong_pose),
        ("campaigns that met another on their cell", outcome.mixed),
        ("campaigns without an end", outcome.unfinished),
        ("times that a campaign asked for a person", len(outcome.asked)),
        ("poses driven to again", outcome.driven_again),
        ("seconds until all readings were there", round(outcome.seconds)),
    ]
    shown = table(("what", "count"), [(name, str(count)) for name, count in rows])
    return "\n".join([shown, *(f"    {line}" for line in outcome.asked)])


def main() -> int:
    """Print the figures; exit status 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=300)
    parser.add_argument("--cells", type=int, default=20)
    parser.add_argument("--workers", type=int, default=3)
    parser.add_argument("--kill-every", type=int, default=30, help="readings between two kills")
    options = parser.parse_args()
    with running_server() as dsn, new_database(dsn) as name:
        outcome = run(
            options.campaigns,
            options.cells,
            options.workers,
            options.kill_every,
            address(dsn, name),
        )
    print(text(outcome))
    wrong = outcome.missing + outcome.doubled + outcome.wrong_pose + outcome.mixed
    return 1 if wrong + outcome.unfinished else 0


if __name__ == "__main__":
    sys.exit(main())
