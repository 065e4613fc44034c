"""Coverage of the registration's intervals and its naming of stage faults, by many seeded runs.

``python -m service.reproduce.stage_study [--runs 1000] [--fault-runs 100] [--seed 1]``. Each run
draws the sensor corrections from their priors, then the noise, and registers as `robocal basecal`
does, faults included.
"""

import argparse
import sys
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

from robocal.base_calibration.corrections import ANGLE_ZERO, N_CORRECTIONS, ROD_ZERO, SQUARENESS
from robocal.base_calibration.faults import SLIPPED, examine
from robocal.base_calibration.stage import Readings, Stage, cup_positions
from robocal.base_calibration.touches import Touches
from robocal.frames import frame_from_xyz_ypr, invert, rotation_vector

STAGE = Stage(
    sigma_slide=0.05e-3,
    sigma_rod=0.02e-3,
    sigma_angle=0.1e-3,
    level_in_master=True,
    level_in_slave=False,
)
_SIGMA_TIP = 0.05e-3
_INTERVAL = 1.959964
"""Half width of a 95 % interval in standard deviations; [1]"""
_GUIDE = frame_from_xyz_ypr(np.array([0.6, 0.8, 0.4, -1.5, 0.0, 0.0]))
_SLAVE = frame_from_xyz_ypr(np.array([2.2, -0.3, 0.05, 2.0, 0.02, -0.01]))
_SLIP = 0.6e-3
"""Size of the slipped touch; smaller ones drown, one touch is sure to about 0.1 mm per axis [m]"""


@dataclass(frozen=True)
class StageFaultCase:
    """One fault to hide."""

    name: str
    correction: int | None
    """Index among the corrections; None for the slipped touch."""
    size: float


FAULT_CASES = (
    StageFaultCase("squareness", SQUARENESS, 1e-3),
    StageFaultCase("angle_zero", ANGLE_ZERO, 2e-3),
    StageFaultCase("rod_zero", ROD_ZERO, 0.2e-3),
    StageFaultCase(SLIPPED, None, _SLIP),
)


def planned_touches() -> Touches:
    """Fifteen touches by each robot: three slide positions, both cups, rod lengths 1 : 2."""
    rows = [
        (by_slave, angle is not None, slide + 1.4 * by_slave, angle or 0.0, length)
        for by_slave in (False, True)
        for slide in (0.0, 0.25, 0.5)
        for angle, length in ((None, 0.0), (0.0, 0.4), (0.9, 0.8), (-0.9, 0.6), (1.4, 0.4))
    ]
    slave, rod, slide, angle, length = (np.array(column) for column in zip(*rows, strict=True))
    n = len(rows)
    return Touches(
        lines=np.arange(2, n + 2),
        by_slave=slave,
        on_rod=rod,
        placement=np.zeros(n, dtype=int),
        readings=Readings(slide, angle, length),
        needle_poses=np.tile(np.eye(4), (n, 1, 1)),
        tip_covariance=np.eye(3 * n) * _SIGMA_TIP**2,
    )


def simulate(
    corrections: Float[Array, "correction"], slip: float, rng: np.random.Generator
) -> tuple[Touches, int | None]:
    """Noisy touches of a stage with these corrections, and the line of the one that slipped."""
    plan = planned_touches()
    n = len(plan)
    tilt = STAGE.sigma_level * rng.normal()
    guide = _GUIDE @ frame_from_xyz_ypr(np.array([0, 0, 0, 0, 0, tilt]))
    up = np.tile(guide[2, :3], (n, 1))
    cups = cup_positions(plan.readings, plan.on_rod, corrections, up, plan.rod_reference)
    places = cups @ guide[:3, :3].T + guide[:3, 3]
    back = invert(_SLAVE)
    tips = np.where(plan.by_slave[:, None], places @ back[:3, :3].T + back[:3, 3], places)
    tips = tips + _SIGMA_TIP * rng.normal(size=(n, 3))
    slipped = int(rng.integers(n))
    direction = rng.normal(size=3)
    tips[slipped] += slip * direction / np.linalg.norm(direction)
    poses = plan.needle_poses.copy()
    poses[:, :3, 3] = tips
    readings = Readings(
        plan.readings.slide + STAGE.sigma_slide * rng.normal(size=n),
        plan.readings.angle + np.where(plan.on_rod, STAGE.sigma_angle * rng.normal(size=n), 0.0),
        plan.readings.length + np.where(plan.on_rod, STAGE.sigma_rod * rng.normal(size=n), 0.0),
    )
    line = int(plan.lines[slipped]) if slip else None
    return replace(plan, readings=readings, needle_poses=poses), line


@dataclass(frozen=True)
class Coverage:
    """How often the truth lay within the 95 % interval, by component, and false alarms."""

    share: Float[Array, "6"]
    runs: int
    false_alarms: int


def coverage(runs: int, seed: int) -> Coverage:
    """Sound stages: corrections within their priors."""
    inside, alarms = np.zeros(6), 0
    for run in range(runs):
        rng = np.random.default_rng((seed, run))
        corrections = STAGE.prior_std * rng.normal(size=N_CORRECTIONS)
        found = examine(simulate(corrections, 0.0, rng)[0], STAGE)
        alarms += bool(found.faults)
        slave = found.solution.state.slave_columns
        std = np.sqrt(np.diag(found.solution.covariance)[slave])
        inside += np.abs(_away(found.solution.state.slave)) <= _INTERVAL * std
    return Coverage(inside / runs, runs, alarms)


def _away(slave: Float[Array, "4 4"]) -> Float[Array, "6"]:
    """Shift [m] and rotation vector [rad] from the estimate to the truth."""
    turn = rotation_vector((_SLAVE[:3, :3] @ slave[:3, :3].T)[None])[0]
    return np.concatenate([_SLAVE[:3, 3] - slave[:3, 3], turn])


def named(case: StageFaultCase, runs: int, seed: int) -> int:
    """How often the hidden fault is the first one named."""
    right = 0
    for run in range(runs):
        rng = np.random.default_rng((seed, run))
        corrections = STAGE.prior_std * rng.normal(size=N_CORRECTIONS)
        if case.correction is not None:
            corrections[case.correction] += case.size
        touches, line = simulate(corrections, case.size if case.correction is None else 0.0, rng)
        faults = examine(touches, STAGE).faults
        right += (
            bool(faults)
            and faults[0].fault == case.name
            and faults[0].lines == (() if line is None else (line,))
        )
    return right


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--fault-runs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--slip-mm", type=float, help="nothing but slips of this size")
    options = parser.parse_args()
    if options.slip_mm is not None:
        slip = StageFaultCase(SLIPPED, None, options.slip_mm * 1e-3)
        right = named(slip, options.fault_runs, options.seed)
        sys.stdout.write(
            f"slip of {options.slip_mm:g} mm named first in {right} of {options.fault_runs}\n"
        )
        return
    done = coverage(options.runs, options.seed)
    shares = ", ".join(f"{share:.1%}" for share in done.share)
    sys.stdout.write(
        f"95 % intervals over {done.runs} runs hold the truth in {done.share.mean():.1%} "
        f"(x, y, z, turns about x, y, z: {shares}); false alarms {done.false_alarms}\n"
    )
    for case in FAULT_CASES:
        right = named(case, options.fault_runs, options.seed)
        sys.stdout.write(f"{case.name} named first in {right} of {options.fault_runs}\n")


if __name__ == "__main__":
    main()
