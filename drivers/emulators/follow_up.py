"""Measure more poses on the cell of a written case.

``python -m drivers.emulators.follow_up --bundle B/0003 --truth T/0003.json --poses next_poses.csv
--out B2/0003`` writes the old rows and, after them, one row for each pose. Columns of the poses:
the joints; `approach1` … and `payload_kg` are heeded where given.
"""

from __future__ import annotations

import argparse
import csv
import sys
from pathlib import Path

import numpy as np

from drivers.emulators.blind_case import draw_case
from drivers.emulators.campaign_draw import extended
from drivers.emulators.dataset import campaign_text, measured
from drivers.emulators.measured_rows import joint_units, write_bundle
from drivers.emulators.records import WorldError
from drivers.emulators.robot_file import NominalRobot, read_robot
from drivers.emulators.true_arm import Vector
from drivers.emulators.truth_file import read_options


def _columns(path: Path) -> dict[str, Vector]:
    with path.open(newline="") as sheet:
        rows = list(csv.DictReader(sheet))
    if not rows:
        raise WorldError("config", f"{path.name}: no poses.")
    # An empty cell asks for nothing in particular.
    return {name: np.array([float(row[name] or 0.0) for row in rows]) for name in rows[0]}


def _joints(columns: dict[str, Vector], robot: NominalRobot) -> Vector:
    names = [f"j{j}_{unit}" for j, (unit, _) in enumerate(joint_units(robot), start=1)]
    missing = [name for name in names if name not in columns]
    if missing:
        raise WorldError("config", f"the poses lack column {missing[0]}.")
    scale = np.array([size for _, size in joint_units(robot)])
    return np.asarray(np.column_stack([columns[name] for name in names]) * scale)


def _approach(columns: dict[str, Vector], n_joints: int) -> Vector | None:
    names = [f"approach{j + 1}" for j in range(n_joints)]
    if not all(name in columns for name in names):
        return None
    return np.column_stack([columns[name] for name in names])


def main() -> int:
    """Write the longer bundle."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("bundle", "truth", "poses", "out"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    arguments = parser.parse_args()
    file = arguments.bundle / "robot.yaml"
    options = read_options(arguments.truth)
    try:
        case = draw_case(read_robot(file), options)
        columns = _columns(arguments.poses)
        q = _joints(columns, case.robot)
        campaign = extended(
            case.campaign, q, _approach(columns, q.shape[1]), columns.get("payload_kg")
        )
        rows = measured(case, campaign)
    except WorldError as fault:
        sys.stderr.write(f"{fault}\n")
        return 2
    write_bundle(arguments.out, file.read_text(), campaign_text(options), rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
