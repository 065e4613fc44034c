"""Make hidden cases with the emulated world's program, and diagnose them from the bundles alone."""

import contextlib
import io
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from traceback import format_exception

from tests.blind.truth import Truth, read_truth
from tests.blind.verdict import BROKEN_DOWN, Verdict, read_verdict

ROOT = Path(__file__).parents[2]
ROBOTS = (
    Path(__file__).parent / "robots" / "staubli_tx60_with_masses.yaml",
    ROOT / "robocal" / "robots" / "ur10e.yaml",
    ROOT / "robocal" / "robots" / "ur5e.yaml",
)
WORKERS = 2
_ROBOTS = tuple(part for robot in ROBOTS for part in ("--robot", str(robot)))
WORLDS = {"first": ("drivers.emulators.dataset", *_ROBOTS), "second": ("tests.second_world",)}
"""Programs that hide effects, with what they need; see `tests/second_world`."""


@dataclass(frozen=True)
class Order:
    """What cases to make."""

    kind: str
    trials: int
    seed: int
    arguments: tuple[str, ...] = ()
    """More options of the program."""
    world: str = "first"


@dataclass(frozen=True)
class Place:
    """Where one case lies."""

    bundle: Path
    truth: Path
    result: Path


@dataclass(frozen=True)
class Trial:
    """Truth and verdict of one case."""

    place: Place
    truth: Truth
    verdict: Verdict


def make(folder: Path, order: Order) -> list[Place]:
    """Write the cases of an order."""
    bundles, truths = folder / "bundles", folder / "truth"
    counts = ["--seed", str(order.seed), "--count", str(order.trials), "--kind", order.kind]
    places = ["--out", str(bundles), "--truth", str(truths)]
    program = [sys.executable, "-m", *WORLDS[order.world]]
    subprocess.run([*program, *counts, *places, *order.arguments], cwd=ROOT, check=True)
    names = [f"{index:04d}" for index in range(order.trials)]
    return [Place(bundles / n, truths / f"{n}.json", folder / "results" / n) for n in names]


def measure_more(place: Place, folder: Path) -> Place:
    """Measure the poses that a diagnosis asked for, on the same cell."""
    longer = Place(folder / "more" / place.bundle.name, place.truth, folder / "more_results")
    arguments = {
        "bundle": place.bundle,
        "truth": place.truth,
        "poses": place.result / "next_poses.csv",
        "out": longer.bundle,
    }
    options = [part for name, path in arguments.items() for part in (f"--{name}", str(path))]
    program = [sys.executable, "-m", "drivers.emulators.follow_up"]
    subprocess.run([*program, *options], cwd=ROOT, check=True)
    return Place(longer.bundle, longer.truth, longer.result / place.bundle.name)


def diagnose_bundle(bundle: Path, result: Path) -> None:
    """Run `robocal diagnose` in this process; a refusal leaves no diagnosis.json."""
    from robocal.errors import BadInput, NoAnswer
    from service.commands.diagnose import diagnose

    result.mkdir(parents=True, exist_ok=True)
    with contextlib.redirect_stdout(io.StringIO()):
        try:
            diagnose(bundle, result)
        except (BadInput, NoAnswer) as refusal:
            (result / "refusal.txt").write_text(str(refusal))


@contextmanager
def workers(count: int = WORKERS) -> Iterator[ProcessPoolExecutor]:
    """Processes of one numerics thread each."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    # A fresh process each: a forked one would inherit the threads of the numerics library.
    fresh = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, mp_context=fresh) as pool:
        yield pool


def diagnose_all(pool: ProcessPoolExecutor, places: list[Place]) -> list[Trial]:
    """Diagnose every case; the truth is opened when all verdicts are there.

    A diagnosis that breaks down spoils neither the others nor the count: it is a verdict too.
    """
    running = [pool.submit(diagnose_bundle, place.bundle, place.result) for place in places]
    for place, future in zip(places, running, strict=True):
        failure = future.exception()
        if failure is not None:
            (place.result / BROKEN_DOWN).write_text("".join(format_exception(failure)))
    return [Trial(place, read_truth(place.truth), read_verdict(place.result)) for place in places]


def run(pool: ProcessPoolExecutor, folder: Path, order: Order) -> list[Trial]:
    """Make and diagnose."""
    return diagnose_all(pool, make(folder, order))
