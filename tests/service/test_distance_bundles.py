"""Bundles of lengths from an anchor, as a draw-wire or ball bar gives them."""

import json
from pathlib import Path

import numpy as np
import pytest

from tests.measured_cell import true_cell, write_bundle

SIGMA = 2e-5


@pytest.fixture
def lengths(tmp_path) -> Path:
    """120 lengths of a UR5e's tool from a point of the measuring frame, not stated."""
    cell = true_cell("ur5e", 3)
    folder = tmp_path / "bundle"
    q = write_bundle(folder, "ur5e", cell, 120, 3, full_pose=False)
    rng = np.random.default_rng(4)
    anchor = cell.true.base[:3, 3] + cell.true.base[:3, :3] @ [1.0, 0.6, 0.2]
    length = np.linalg.norm(cell.true.poses(q)[:, :3, 3] - anchor, axis=1)
    length += rng.normal(size=len(q)) * SIGMA
    head = ",".join([*(f"j{joint}_deg" for joint in range(1, 7)), "distance_mm"])
    table = np.column_stack([np.degrees(q), length * 1e3]).tolist()
    rows = [",".join(f"{value:.9f}" for value in row) for row in table]
    (folder / "measurements.csv").write_text("\n".join([head, *rows]) + "\n")
    return folder


@pytest.mark.parametrize("command", ["identify", "uncertainty", "diagnose"])
def test_lengths_alone_without_a_stated_anchor_are_refused(call, lengths, tmp_path, command):
    status, _, said = call(command, lengths, "--out", tmp_path / "out")
    assert (status, said.count("\n")) == (2, 1)
    assert "campaign.yaml: field 'anchor' is missing" in said
    assert "0, 0, 0" in said


def test_lengths_from_a_stated_anchor_are_announced_as_distances(call, lengths, tmp_path):
    campaign = lengths / "campaign.yaml"
    campaign.write_text(campaign.read_text() + "anchor: {xyz_mm: [0, 0, 0]}\n")
    status, printed, _ = call("identify", lengths, "--out", tmp_path / "out")
    assert status == 0
    assert "120 rows (distances)" in printed
    document = json.loads((tmp_path / "out" / "identification.json").read_text())
    assert document["residuals"]["held_out"]["position_rms_mm"] < 0.06
    assert document["anchor"]["xyz_mm"] == [0, 0, 0]


def test_a_mixture_is_announced_with_its_parts(call, lengths, tmp_path):
    table = lengths / "measurements.csv"
    cell = true_cell("ur5e", 3)
    head, *rows = table.read_text().splitlines()
    q = np.radians([[float(v) for v in row.split(",")[:6]] for row in rows])
    seen = cell.true.poses(q)[:, :3, 3] * 1e3
    lines = [
        f"{row},{x:.6f},{y:.6f},{z:.6f}" if number % 3 else f"{row},,,"
        for number, (row, (x, y, z)) in enumerate(zip(rows, seen.tolist(), strict=True))
    ]
    table.write_text("\n".join([f"{head},x_mm,y_mm,z_mm", *lines]) + "\n")
    status, printed, _ = call("identify", lengths, "--out", tmp_path / "out")
    assert status == 0
    assert "120 rows (120 distances, 80 positions)" in printed
