"""Bundles measured on a robot whose truth is known, written without any code of robocal."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from tests.elementary_kinematics import ROBOTS, Arm, load_arm, random_frame

SIGMA_MM = 0.015
SIGMA_PPM = 6
SIGMA_MRAD = 0.05
CAMPAIGN = f"""robot: robot.yaml
instrument:
  {{kind: laser_tracker, sigma_mm: {SIGMA_MM}, sigma_ppm: {SIGMA_PPM}, sigma_mrad: {SIGMA_MRAD}}}
gravity: [0, 0, -1]
"""


@dataclass(frozen=True)
class Cell:
    """The truth behind a bundle."""

    nominal: Arm
    true: Arm


def true_cell(
    robot: str, seed: int, tool_point=(0.06, -0.04, 0.12), wrong: tuple[str, ...] | None = None
) -> Cell:
    """A robot off its nominal geometry by about 0.4 mm and 1 mrad, in frames that nobody knows.

    `wrong` names the link parameters (theta_2, d_3) that are off; all of them unless given.
    """
    rng = np.random.default_rng(seed)
    nominal = load_arm(robot)
    errors = rng.normal(size=nominal.links.shape) * [1e-3, 0.4e-3, 0.4e-3, 1e-3, 1e-3]
    if wrong is not None:
        names = ("theta", "d", "a", "alpha", "beta")
        for (joint, column), _ in np.ndenumerate(errors):
            if f"{names[column]}_{joint + 1}" not in wrong:
                errors[joint, column] = 0.0
    tool = random_frame(rng, 0.0)
    tool[:3, 3] = tool_point
    true = replace(nominal, links=nominal.links + errors).within(random_frame(rng, 2.0), tool)
    return Cell(nominal, true)


def position_sigma(position: np.ndarray) -> np.ndarray:
    """Standard deviation of each coordinate, as the campaign file states it [m]."""
    ranges = np.linalg.norm(position, axis=1, keepdims=True)
    return np.hypot(SIGMA_MM * 1e-3, SIGMA_PPM * 1e-6 * ranges)


def measure(
    arm: Arm, q: np.ndarray, rng: np.random.Generator, noise: float = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Noisy positions [m] and quaternions w, x, y, z."""
    T = arm.poses(q)
    position = T[:, :3, 3]
    position = position + noise * rng.normal(size=position.shape) * position_sigma(position)
    small = Rotation.from_rotvec(noise * SIGMA_MRAD * 1e-3 * rng.normal(size=(len(q), 3)))
    x, y, z, w = (small * Rotation.from_matrix(T[:, :3, :3])).as_quat().T
    return position, np.column_stack([w, x, y, z])


def header(arm: Arm, *, full_pose: bool) -> list[str]:
    """Column names of measurements.csv."""
    joints = [f"j{i + 1}_{'mm' if p else 'deg'}" for i, p in enumerate(arm.prismatic)]
    return [*joints, "x_mm", "y_mm", "z_mm", *(("qw", "qx", "qy", "qz") if full_pose else ())]


def write_bundle(
    folder: Path,
    robot: str,
    cell: Cell,
    rows: int = 60,
    seed: int = 1,
    *,
    full_pose: bool = True,
    noise: float = 1.0,
) -> np.ndarray:
    """Measure a cell into a folder; the joint readings that were used [rad or m]."""
    rng = np.random.default_rng(seed)
    q = cell.nominal.draw(rng, rows, widest=2.5)
    position, quaternion = measure(cell.true, q, rng, noise)
    table = [q / cell.nominal.units(), position * 1e3]
    if full_pose:
        table.append(quaternion)
    lines = [",".join(header(cell.nominal, full_pose=full_pose))]
    lines += [",".join(f"{value:.10f}" for value in row) for row in np.hstack(table)]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "robot.yaml").write_text((ROBOTS / f"{robot}.yaml").read_text())
    (folder / "campaign.yaml").write_text(CAMPAIGN)
    (folder / "measurements.csv").write_text("\n".join(lines) + "\n")
    return q
