"""How far lengths alone miss the nominal robot, as they should be and spoilt.

``python -m tests.robocal.data_faults.length_study --sets 240``
"""

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from robocal.data_faults.hypotheses import chain_length
from robocal.data_faults.length_misfit import missed_lengths
from robocal.formats.bundle import read_bundle
from tests.robocal.data_faults.slip_study import sound_target
from tests.robocal.data_faults.spoiled import NAMES


def misses(folder: Path, seed: int) -> dict[str, float]:
    """What 85 % of the lengths stay below, over the robot's length, for each way of spoiling."""
    rng = np.random.default_rng([seed, 3])
    campaign = sound_target(seed, rng, NAMES[seed % len(NAMES)])
    campaign = replace(campaign, rows=int(rng.integers(30, 100)), full_pose=False)
    campaign.measure().write(folder, campaign.robot)
    bundle = read_bundle(folder)
    q, position = bundle.measurements.joints, bundle.measurements.position
    length = np.linalg.norm(position - position.mean(axis=0) - 0.8 * rng.normal(size=3), axis=1)
    sign = np.where(np.arange(bundle.robot.n_joints) == 2, -1.0, 1.0)
    spoilt = {
        "sound": (q, length),
        "in metres": (q, length / 1e3),
        "in inches": (q, length / 25.4),
        "a row off": (np.roll(q, 1, axis=0), length),
        "joint 3 turned": (q * sign, length),
        "joints in radians": (np.radians(q), length),
    }
    robot = bundle.robot
    return {
        name: float(np.quantile(missed_lengths(robot.geometry, *case), 0.85, method="lower"))
        / chain_length(robot)
        for name, case in spoilt.items()
    }


def main() -> None:
    """Print the spread of the misses and the share that is refused."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=240)
    sets = parser.parse_args().sets
    with tempfile.TemporaryDirectory() as name:
        all_misses = [misses(Path(name), seed) for seed in range(sets)]
    for case in all_misses[0]:
        found = np.array([one[case] for one in all_misses])
        least, median, most = np.quantile(found, [0.0, 0.5, 1.0])
        sys.stdout.write(
            f"{case}: {least:.2%}, median {median:.2%}, at most {most:.2%} of the robot's length; "
            f"refused {np.count_nonzero(found > 0.05)} of {sets}\n"
        )


if __name__ == "__main__":
    main()
