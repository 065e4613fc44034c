"""A robot learnt on one series, taken to another by 30 poses: `python -m tests.studies.stationing`.

Needs the measured bundles beside the checkout (shared/data). Diagnoses series A, then fits base and
tool to 30 poses of series B, evenly in file order and drawn five times, and prints what is left on
all other rows of B.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from robocal.calibrated import Provenance
from robocal.diagnosis.diagnose import diagnose
from robocal.formats.bundle import Bundle, read_bundle
from robocal.stationing import station

DATA = Path(__file__).parents[2].parent / "shared" / "data"
NOWHERE = Provenance("", "", "", "simultaneous")
POSES, DRAWS = 30, 5


def with_poses(bundle: Bundle, chosen: np.ndarray) -> Bundle:
    """The bundle with these poses to fit and everything else held out."""
    rows = bundle.measurements
    fitted = np.isin(rows.pose, chosen) & ~rows.held_out
    return replace(bundle, measurements=replace(rows, held_out=~fitted))


def main() -> int:
    """Print one line for each choice of poses."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the measured bundles")
    folder = parser.parse_args().data
    learnt = diagnose(read_bundle(folder / "ipa_ur10_a"), NOWHERE)
    sys.stdout.write(f"series A, held out: {learnt.gain.after * 1e3:.4f} mm\n")
    there = read_bundle(folder / "ipa_ur10_b")
    rows = there.measurements
    poses = np.unique(rows.pose[~rows.held_out])
    choices = {"evenly": poses[np.linspace(0, len(poses) - 1, POSES).astype(int)]}
    for seed in range(1, DRAWS + 1):
        drawn = np.random.default_rng(seed).choice(poses, POSES, replace=False)
        choices[f"drawn {seed}"] = drawn
    for name, chosen in choices.items():
        found = station(learnt.calibrated, with_poses(there, chosen), NOWHERE)
        left = found.held_out.position_rms * 1e3
        sys.stdout.write(f"{name}: {left:.4f} mm, {len(found.left_behind)} effects left behind\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
