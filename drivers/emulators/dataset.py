"""Write measured campaigns with something hidden in them, and apart from them what it is.

``python -m drivers.emulators.dataset --seed 7 --count 20 --kind one --robot ur10e.yaml --out B
--truth T`` writes bundles B/0000, B/0001 … and the sealed T/0000.json, T/0001.json …. Each is drawn
from the seed and its number alone. The robot's file needs masses; of several files one is drawn.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from drivers.emulators.blind_case import KINDS, Case, Options, draw_case, slip_draw
from drivers.emulators.campaign_draw import Campaign, Size
from drivers.emulators.measured_rows import Rows, tabulate, write_bundle
from drivers.emulators.records import WorldError
from drivers.emulators.robot_file import read_robot
from drivers.emulators.slips import SLIPS, Spoilt, slips_of
from drivers.emulators.truth_file import write_truth


def campaign_text(options: Options) -> str:
    """campaign.yaml."""
    return (
        "robot: robot.yaml\n"
        f"instrument: {{kind: laser_tracker, sigma_mm: {options.sigma_mm:g}, sigma_ppm: 0, "
        f"sigma_mrad: {options.sigma_mrad:g}}}\n"
        "gravity: [0, 0, -1]\n"
        "held_out: {column: split}\n"
    )


def measured(case: Case, campaign: Campaign) -> Rows:
    """Return the table of a campaign measured on a case's cell."""
    temperature = campaign.temperature_degc if case.has_probe else None
    return tabulate(case.robot, campaign, case.read(campaign), temperature)


def spoil(case: Case, rows: Rows) -> Spoilt | None:
    """Put a fault into the data, if the case is about one."""
    if case.options.kind != "data_fault":
        return None
    draw = slip_draw(case.options)
    name = case.options.effect or str(draw.choice(slips_of(rows)))
    return SLIPS[name](rows, draw)


def write_case(robot: Path, options: Options, bundle: Path, truth: Path) -> None:
    """Draw one case; write its bundle and its truth."""
    case = draw_case(read_robot(robot), options)
    rows = measured(case, case.campaign)
    spoilt = spoil(case, rows)
    write_bundle(
        bundle, robot.read_text(), campaign_text(options), rows if spoilt is None else spoilt.rows
    )
    write_truth(truth, case, spoilt)


def _options(arguments: argparse.Namespace) -> Options:
    return Options(
        seed=arguments.seed,
        index=0,
        kind=arguments.kind,
        size=Size(arguments.poses, arguments.repeats, arguments.check, arguments.joint_range),
        factor=arguments.size,
        orientation=arguments.orientation,
        sigma_mm=arguments.sigma_mm,
    )


def _parser() -> argparse.ArgumentParser:
    size, options = Size(), Options(0, 0, "clean")
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robot", type=Path, action="append", required=True, help="robot.yaml")
    parser.add_argument("--out", type=Path, required=True, help="folder for the bundles")
    parser.add_argument("--truth", type=Path, required=True, help="folder for the sealed truth")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=1, help="how many bundles")
    parser.add_argument("--kind", choices=KINDS, default="one")
    parser.add_argument(
        "--effect",
        action="append",
        help="hide this one (or this fault) instead of drawing it; several take turns",
    )
    parser.add_argument("--size", type=float, default=options.factor, help="factor on all sizes")
    parser.add_argument("--poses", type=int, default=size.poses)
    parser.add_argument("--repeats", type=int, default=size.repeats, help="rows that come again")
    parser.add_argument("--check", type=int, default=size.check, help="rows of split check")
    parser.add_argument("--joint-range", type=float, default=size.joint_range, help="0 to 1")
    parser.add_argument("--sigma-mm", type=float, default=options.sigma_mm)
    parser.add_argument("--orientation", action="store_true", help="read full poses")
    return parser


def main() -> int:
    """Write the bundles."""
    arguments = _parser().parse_args()
    options = _options(arguments)
    effects = arguments.effect or [None]
    arguments.truth.mkdir(parents=True, exist_ok=True)
    for index in range(arguments.count):
        name = f"{index:04d}"
        number = int(np.random.default_rng([options.seed, index]).integers(len(arguments.robot)))
        case = replace(options, index=index, effect=effects[index % len(effects)])
        try:
            write_case(
                arguments.robot[number],
                case,
                arguments.out / name,
                arguments.truth / f"{name}.json",
            )
        except WorldError as fault:
            sys.stderr.write(f"{fault}\n")
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
