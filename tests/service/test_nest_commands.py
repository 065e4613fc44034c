"""`predict` and `compensate` with several nests on the tool: each row means the nest it names."""

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.elementary_kinematics import shift
from tests.measured_cell import Cell, position_sigma, true_cell, write_bundle

PLACES = {"n1": (0.05, 0.0, 0.1), "n2": (-0.06, 0.03, 0.12), "n3": (0.0, -0.08, 0.09)}
HEADER = "x_mm,y_mm,z_mm,qw,qx,qy,qz,target"


def nest_poses(cell: Cell, q: np.ndarray, names: list[str]) -> np.ndarray:
    """True poses of the named nests: the flange's axes, at the nest."""
    poses = np.empty((len(q), 4, 4))
    for row, name in enumerate(names):
        x, y, z = PLACES[name]
        there = replace(cell.true, tool=shift("x", x) @ shift("y", y) @ shift("z", z))
        poses[row] = there.poses(q[row : row + 1])[0]
    return poses


def joints_csv(path: Path, q: np.ndarray, names: list[str]) -> Path:
    head = ",".join(f"j{joint}_deg" for joint in range(1, 7))
    rows = [",".join(f"{v:.10f}" for v in np.degrees(row)) for row in q]
    lines = [f"{row},{name}" for row, name in zip(rows, names, strict=True)]
    path.write_text("\n".join([f"{head},target", *lines]) + "\n")
    return path


@pytest.fixture(scope="module")
def nests(tmp_path_factory) -> tuple[Path, Cell]:
    """90 rows of a UR10e, three nests in turn at places that nobody states."""
    folder = tmp_path_factory.mktemp("nests")
    cell = true_cell("ur10e", 5)
    q = write_bundle(folder, "ur10e", cell, 90, 5, full_pose=False)
    names = [f"n{1 + row % 3}" for row in range(90)]
    position = nest_poses(cell, q, names)[:, :3, 3]
    rng = np.random.default_rng(6)
    position = position + rng.normal(size=position.shape) * position_sigma(position)
    lines = joints_csv(folder / "measurements.csv", q, names).read_text().splitlines()
    seen = ["x_mm,y_mm,z_mm", *(",".join(f"{v:.6f}" for v in row) for row in position * 1e3)]
    both = [f"{line},{place}" for line, place in zip(lines, seen, strict=True)]
    (folder / "measurements.csv").write_text("\n".join(both) + "\n")
    with (folder / "campaign.yaml").open("a") as file:
        file.write("targets: {n1: {}, n2: {}, n3: {}}\n")
    return folder, cell


@pytest.fixture
def model(nests, call, tmp_path) -> Path:
    assert call("identify", nests[0], "--out", tmp_path)[0] == 0
    return tmp_path / "model.yaml"


def test_each_row_is_predicted_at_the_nest_it_names(nests, model, call, tmp_path):
    cell = nests[1]
    q = cell.nominal.draw(np.random.default_rng(7), 30, widest=2.0)
    names = [f"n{3 - row % 3}" for row in range(30)]
    out = tmp_path / "out.csv"
    assert call("predict", model, joints_csv(tmp_path / "q.csv", q, names), "--out", out)[0] == 0
    rows = list(csv.DictReader(out.read_text().splitlines()))
    found = np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows]) * 1e-3
    wanted = nest_poses(cell, q, names)
    # The noise is 0.02 mm a coordinate; the nests are 100 mm from the flange and from each other.
    assert np.linalg.norm(found - wanted[:, :3, 3], axis=1).max() < 1.5e-4


@pytest.mark.parametrize(
    ("name", "complaint"),
    [
        ("", "line 2: names no target, and the model knows nests alone: put one of n1, n2, n3"),
        ("n9", "line 2: target 'n9' is not in the model (its nests: n1, n2, n3)"),
    ],
)
def test_a_row_that_names_no_nest_of_the_model_is_refused(model, call, tmp_path, name, complaint):
    poses = joints_csv(tmp_path / "q.csv", np.full((1, 6), 0.3), [name])
    out = tmp_path / "out.csv"
    status, _, said = call("predict", model, poses, "--out", out)
    assert (status, said.count("\n")) == (2, 1)
    assert complaint in said
    assert not out.exists()


def test_compensation_brings_the_named_nest_to_its_target(nests, model, call, tmp_path):
    cell = nests[1]
    q = cell.nominal.draw(np.random.default_rng(8), 12, widest=1.5)
    names = [f"n{1 + row % 2}" for row in range(12)]
    wanted = nest_poses(
        Cell(cell.nominal, cell.nominal.within(cell.true.base, cell.true.tool)), q, names
    )
    quaternion = Rotation.from_matrix(wanted[:, :3, :3]).as_quat(scalar_first=True)
    table = np.hstack([wanted[:, :3, 3] * 1e3, quaternion])
    head, *joints = joints_csv(tmp_path / "q.csv", q, names).read_text().splitlines()
    seen = [",".join(map(repr, row)) for row in table.tolist()]
    lines = [f"{a},{b}" for a, b in zip(joints, seen, strict=True)]
    targets = tmp_path / "targets.csv"
    targets.write_text("\n".join([f"{head},{HEADER.removesuffix(',target')}", *lines]) + "\n")
    out = tmp_path / "out.csv"
    assert call("compensate", model, targets, "--out", out)[0] == 0
    rows = list(csv.DictReader(out.read_text().splitlines()))
    good = [row for row, line in enumerate(rows) if line["status"] == "reached"]
    assert len(good) >= 8
    found = np.radians([[float(rows[row][f"j{k}_deg"]) for k in range(1, 7)] for row in good])
    there = nest_poses(cell, found, [names[row] for row in good])[:, :3, 3]
    assert np.linalg.norm(there - wanted[good, :3, 3], axis=1).max() < 1.5e-4
