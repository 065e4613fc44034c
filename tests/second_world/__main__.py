"""Write bundles with hidden effects: `python -m tests.second_world --kind one --count 10 ...`.

The sealed truths have the form that `tests/blind/truth.py` reads.
"""

import argparse
import csv
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.second_world.arm import N
from tests.second_world.campaign import ROBOT, SIGMA, Campaign, Change
from tests.second_world.draw import Hidden
from tests.second_world.families import FAMILIES, KINDS, drawn


def moved(campaign: Campaign, effects: list[Hidden]) -> np.ndarray:
    """Where the nest goes with these effects."""
    change = Change(campaign.n)
    for effect in effects:
        effect.act(campaign, change)
    return campaign.positions(change)


def write_bundle(folder: Path, campaign: Campaign, position: np.ndarray) -> None:
    """robot.yaml, campaign.yaml and measurements.csv."""
    folder.mkdir(parents=True)
    shutil.copy(ROBOT, folder / "robot.yaml")

    def in_mm(place: np.ndarray) -> list[float]:
        return [round(float(x) * 1e3, 3) for x in place]

    ypr = [round(float(angle), 4) for angle in np.rad2deg(campaign.ypr_guess)]
    document = {
        "robot": "robot.yaml",
        "instrument": {"kind": "laser_tracker", "sigma_mm": round(SIGMA * 1e3, 6), "sigma_ppm": 0},
        "base_guess": {"xyz_mm": in_mm(campaign.base_guess), "ypr_deg": ypr},
        "tool_guess": {"xyz_mm": in_mm(campaign.tool_guess), "ypr_deg": [0, 0, 0]},
        "gravity": [0, 0, -1],
        "held_out": {"column": "split"},
    }
    (folder / "campaign.yaml").write_text(yaml.safe_dump(document, sort_keys=False))
    joints = range(1, N + 1)
    angles, sides = [f"j{j}_deg" for j in joints], [f"approach{j}" for j in joints]
    with (folder / "measurements.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        more = ["temperature_degc", "payload_kg"]
        writer.writerow(["pose", "t_s", *angles, "x_mm", "y_mm", "z_mm", *more, *sides, "split"])
        for row in range(campaign.n):
            writer.writerow([
                row,
                f"{campaign.time[row]:.1f}",
                *(f"{angle:.7f}" for angle in np.rad2deg(campaign.q[row])),
                *(f"{x:.5f}" for x in position[row] * 1e3),
                f"{campaign.temperature[row]:.2f}",
                f"{campaign.payload[row]:g}",
                *campaign.approach[row],
                "check" if campaign.check[row] else "fit",
            ])


def truth_of(campaign: Campaign, effects: list[Hidden], kind: str) -> dict[str, Any]:
    """What was hidden, and how much of it geometry leaves."""
    still = campaign.positions()
    entries = []
    for place, effect in enumerate(effects):
        left = campaign.left_by_geometry(moved(campaign, [effect]) - still)
        strength = float(np.linalg.norm(left)) / SIGMA
        entries.append({
            "effect": effect.effect,
            "joint": effect.joint,
            "order": effect.order,
            "entries": {} if effect.driven_by is None else {"driven_by": effect.driven_by},
            "listed": True,
            "main": place == 0 or kind == "two",
            "snr": strength / len(left) ** 0.5,
            "strength": strength,
        })
    return {
        "options": {"kind": kind},
        "effects": entries,
        "covariates": [],
        "kindred": [],
        "fault": None,
        "noise_floor_mm": SIGMA * 3**0.5 * 1e3,
    }


def main() -> None:
    """Write the cases."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, default=1)
    parser.add_argument("--kind", choices=KINDS, default="one")
    parser.add_argument("--effect", choices=FAMILIES, help="hide this one first")
    parser.add_argument("--out", type=Path, required=True, help="folder for bundles")
    parser.add_argument("--truth", type=Path, required=True, help="folder for truths")
    options = parser.parse_args()
    options.truth.mkdir(parents=True, exist_ok=True)
    for index in range(options.count):
        rng = np.random.default_rng([options.seed, KINDS.index(options.kind), index])
        campaign = Campaign(rng)
        effects = drawn(options.kind, rng, campaign, options.effect)
        position = moved(campaign, effects) + campaign.noise
        write_bundle(options.out / f"{index:04d}", campaign, position)
        truth = truth_of(campaign, effects, options.kind)
        (options.truth / f"{index:04d}.json").write_text(json.dumps(truth, indent=1))


if __name__ == "__main__":
    main()
