"""Bundles in memory, measured on true arms in every way that the contract knows."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from robocal.formats.bundle import Bundle, Target, read_bundle
from tests.measured_cell import Cell, true_cell, write_bundle


def measured(
    folder: Path, robot: str, seed: int, rows: int, *, full_pose: bool
) -> tuple[Bundle, Cell, np.ndarray]:
    """A bundle whose rows are all to be fitted, its truth, and the true tool frames' poses."""
    cell = true_cell(robot, seed)
    q = write_bundle(folder, robot, cell, rows, seed, full_pose=full_pose)
    bundle = read_bundle(folder)
    measurements = replace(bundle.measurements, held_out=np.zeros(rows, dtype=bool))
    return replace(bundle, measurements=measurements), cell, cell.true.poses(q)


def with_nests(bundle: Bundle, cell: Cell, places: np.ndarray, seed: int, sigma: float) -> Bundle:
    """The same joints, each row measuring one of several nests on the flange in turn."""
    rng = np.random.default_rng(seed)
    q = bundle.measurements.joints
    flange = replace(cell.true, tool=np.eye(4)).poses(q)
    which = np.arange(len(q)) % len(places)
    position = np.einsum("mij,mj->mi", flange[:, :3, :3], places[which]) + flange[:, :3, 3]
    position += rng.normal(size=position.shape) * sigma
    rows = replace(
        bundle.measurements,
        position=position,
        orientation=np.full((len(q), 4), np.nan),
        target=tuple(f"n{k + 1}" for k in which),
    )
    targets = {f"n{k + 1}": Target(None, fixed=False) for k in range(len(places))}
    return replace(bundle, measurements=rows, targets=targets)


def lengths_from(anchor: np.ndarray, T: np.ndarray, seed: int, sigma: float) -> np.ndarray:
    """Noisy distances of the tool from a point of the measuring frame."""
    rng = np.random.default_rng(seed)
    return np.linalg.norm(T[:, :3, 3] - anchor, axis=1) + rng.normal(size=len(T)) * sigma


def tool_distances(poses: np.ndarray) -> np.ndarray:
    """Distances between tool positions in pairs, which no choice of frame changes."""
    half = len(poses) // 2
    return np.linalg.norm(poses[:half, :3, 3] - poses[half : 2 * half, :3, 3], axis=1)
