"""Hide an effect, ask for it, count: `python -m tests.blind --trials 100 --kind one --kind clean`.

Seeds are fresh in every run and printed; with `--seed` a run is repeated. `--keep FOLDER` keeps
bundles, diagnoses and truths for a look. The kind `cell` goes through the service and is run only
when it is asked for. The second world knows neither poses of another number nor full poses, and
of the kinds only those with effects of the catalogue.
"""

import argparse
import secrets
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.blind.cells import cell_rates, run_cells
from tests.blind.confusion import broken, confusion, worst
from tests.blind.rates import RATES, Line, ambiguous, is_ambiguous
from tests.blind.trials import (
    WORKERS,
    WORLDS,
    Order,
    Trial,
    diagnose_all,
    make,
    measure_more,
    run,
    workers,
)
from tests.second_world.families import KINDS as SECOND_WORLD_KINDS

FEW_POSES = ("--poses", "60", "--repeats", "9", "--size", "0.5")
AMBIGUOUS, CELL = "ambiguous", "cell"
KINDS = {"first": (*RATES, AMBIGUOUS), "second": SECOND_WORLD_KINDS}
WITHOUT_CONFUSION = {"clean"}


def say(*lines: str) -> None:
    """Print lines at once, also into a pipe."""
    sys.stdout.write("\n".join(lines) + "\n")
    sys.stdout.flush()


def judge(pool: ProcessPoolExecutor, folder: Path, order: Order) -> tuple[list[Line], list[Trial]]:
    """Run the trials of one kind; give its lines of the table and the trials."""
    if order.kind == CELL:
        in_cells = run_cells(folder, order)
        return cell_rates(in_cells), list(in_cells)
    if order.kind != AMBIGUOUS:
        trials = run(pool, folder, order)
        return RATES[order.kind](trials), trials
    few = Order("one", order.trials, order.seed, (*FEW_POSES, *order.arguments))
    before = diagnose_all(pool, make(folder, few))
    unsure = [t for t in before if is_ambiguous(t)]
    asked = [t.place for t in unsure if (t.place.result / "next_poses.csv").exists()]
    after = diagnose_all(pool, [measure_more(place, folder) for place in asked])
    return ambiguous(before, after), before


def report(order: Order, folder: Path, pool: ProcessPoolExecutor) -> bool:
    """Print what one kind of trials gives; say whether every diagnosis came to its end."""
    begun = time.monotonic()
    lines, trials = judge(pool, folder, order)
    say(f"\n{order.kind}: {order.trials} trials, {time.monotonic() - begun:.0f} s")
    say(*(line.text() for line in lines))
    if order.kind not in WITHOUT_CONFUSION:
        say(*confusion(trials), *worst(trials))
    failures = broken(trials)
    if failures:
        say(*failures)
    return not failures


def main() -> int:
    """Print the tables; 1 if a diagnosis broke down."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=150, help="of each kind")
    parser.add_argument("--kind", action="append", choices=(*RATES, AMBIGUOUS, CELL))
    parser.add_argument("--seed", type=int, help="repeat the run that printed it")
    parser.add_argument("--orientation", action="store_true", help="full poses (6D)")
    parser.add_argument("--effect", help="hide only this one")
    parser.add_argument("--poses", type=int, help="another number of poses than 120")
    parser.add_argument("--world", choices=WORLDS, default="first", help="what hides the effects")
    parser.add_argument("--keep", type=Path, help="folder for bundles, truths and diagnoses")
    parser.add_argument("--workers", type=int, default=WORKERS, help="processes side by side")
    options = parser.parse_args()
    seed = secrets.randbits(31) if options.seed is None else options.seed
    arguments = ("--orientation",) * options.orientation
    if options.effect:
        arguments = (*arguments, "--effect", options.effect)
    if options.poses:
        arguments = (*arguments, "--poses", str(options.poses))
    say(f"seed {seed}: repeat with --seed {seed}, the same kinds and --trials {options.trials}")
    with TemporaryDirectory() as scratch, workers(options.workers) as pool:
        ended = [
            report(
                Order(kind, options.trials, seed, arguments, options.world),
                (options.keep or Path(scratch)) / kind,
                pool,
            )
            for kind in options.kind or KINDS[options.world]
        ]
    return 0 if all(ended) else 1


if __name__ == "__main__":
    sys.exit(main())
