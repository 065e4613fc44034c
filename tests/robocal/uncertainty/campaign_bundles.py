"""Bundles for the tests of this folder: what was measured, identified, and taken up again."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from robocal.formats.bundle import Bundle, read_bundle
from robocal.identification.identify import identify
from robocal.uncertainty.fitted_rows import FittedRows, fitted_rows
from tests.elementary_kinematics import Arm
from tests.measured_cell import measure, true_cell, write_bundle


@dataclass(frozen=True)
class Campaign:
    """One bundle with everything that was made of it."""

    bundle: Bundle
    fit: FittedRows
    true: Arm


def campaign(
    folder: Path,
    robot: str = "staubli_tx60",
    seed: int = 1,
    rows: int = 40,
    repeats: int = 1,
    *,
    full_pose: bool = True,
    noise: float = 1.0,
    **changes: object,
) -> Campaign:
    """Measure a cell, every pose so many times, and identify it; `noise` scales the real one."""
    cell = true_cell(robot, seed)
    write_bundle(folder, robot, cell, rows, seed, full_pose=full_pose, noise=noise)
    bundle = read_bundle(folder)
    rng = np.random.default_rng([seed, 5])
    again = np.tile(np.arange(rows), repeats)
    first = bundle.measurements
    position, quaternion = measure(cell.true, first.joints[again], rng, noise)
    measured = replace(
        first,
        lines=np.arange(len(again)) + 2,
        joints=first.joints[again],
        position=position,
        orientation=quaternion if full_pose else np.full((len(again), 4), np.nan),
        distance=np.full(len(again), np.nan),
        pose=again,
        target=("",) * len(again),
        held_out=np.zeros(len(again), dtype=bool),
        **{
            name: getattr(first, name)[again]
            for name in (
                "time", "temperature", "payload", "speed", "settle", "approach", "commanded"
            )
        },
    )  # fmt: skip
    bundle = replace(bundle, measurements=measured, **changes)
    return Campaign(bundle, fitted_rows(bundle, identify(bundle)), cell.true)
