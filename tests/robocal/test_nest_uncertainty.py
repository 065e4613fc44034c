"""How sure a nest's place is, against normal equations from elementary matrices alone."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from robocal.identification.priors import PRIOR_ANGLE, PRIOR_LENGTH
from tests.elementary_kinematics import ROBOTS, Arm, turn
from tests.measured_cell import CAMPAIGN, position_sigma, true_cell

PLACES = {"n1": (0.06, -0.04, 0.12), "n2": (-0.08, 0.05, 0.10), "n3": (0.02, 0.09, 0.16)}
POSES = 14
STEP = 1e-6
N_LINKS, N_BASE = 30, 6
NOWHERE = 10.0
"""Prior of what nothing is known of [m, rad]"""


def places_at(x: np.ndarray, arm: Arm, q: np.ndarray, nests: list[str]) -> np.ndarray:
    """Where each row's nest is once links, base and the nests' places have moved by x."""
    base = np.eye(4)
    base[:3, 3] = x[30:33]
    yaw, pitch, roll = x[33:36]
    base = base @ turn("z", yaw) @ turn("y", pitch) @ turn("x", roll)
    moved = replace(arm, links=arm.links + x[:30].reshape(6, 5), base=arm.base @ base)
    flange = moved.poses(q)
    coordinates = x[36:].reshape(-1, 3)
    names = list(PLACES)
    offset = np.array([np.array(PLACES[n]) + coordinates[names.index(n)] for n in nests])
    return flange[:, :3, 3] + (flange[:, :3, :3] @ offset[:, :, None])[:, :, 0]


def jacobian(arm: Arm, q: np.ndarray, nests: list[str]) -> np.ndarray:
    """Row, axis, unknown; by central differences."""
    steps = np.eye(N_LINKS + N_BASE + 3 * len(PLACES)) * STEP
    return np.stack(
        [(places_at(s, arm, q, nests) - places_at(-s, arm, q, nests)) / (2 * STEP) for s in steps],
        axis=-1,
    )


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """A bundle of three nests of unknown place, the arm behind it, and poses to predict."""
    folder, rng = tmp_path_factory.mktemp("nests"), np.random.default_rng(4)
    cell = true_cell("staubli_tx60", 4, tool_point=(0.0, 0.0, 0.0))
    arm = replace(cell.true, tool=np.eye(4))
    q = np.repeat(cell.nominal.draw(rng, POSES, widest=2.5), len(PLACES), axis=0)
    nests = list(PLACES) * POSES
    nothing = np.zeros(N_LINKS + N_BASE + 3 * len(PLACES))
    seen = places_at(nothing, arm, q, nests)
    sigma = position_sigma(seen)
    table = np.hstack([np.degrees(q), (seen + sigma * rng.normal(size=seen.shape)) * 1e3])
    joints = [f"j{number}_deg" for number in range(1, 7)]
    (folder / "robot.yaml").write_text((ROBOTS / "staubli_tx60.yaml").read_text())
    stated = "".join(f"  {name}: {{}}\n" for name in PLACES)
    settings = f"held_out: {{fraction: 0}}\ntargets:\n{stated}"
    (folder / "campaign.yaml").write_text(CAMPAIGN + settings)
    write(folder / "measurements.csv", [*joints, "x_mm", "y_mm", "z_mm", "target"], table, nests)
    new = cell.nominal.draw(rng, 6, widest=2.5)
    asked = ["n1", "n2", "n3"] * 2
    write(folder / "poses.csv", [*joints, "target"], np.degrees(new), asked)
    J = (jacobian(arm, q, nests) / sigma[:, :, None]).reshape(-1, len(nothing))
    links = [PRIOR_ANGLE, PRIOR_LENGTH, PRIOR_LENGTH, PRIOR_ANGLE, PRIOR_ANGLE] * 6
    prior = np.array([*links, *[NOWHERE] * (len(nothing) - N_LINKS)])
    covariance = np.linalg.inv(J.T @ J + np.diag(prior**-2.0))
    J = jacobian(arm, new, asked)
    return folder, np.sqrt(np.einsum("nki,ij,nkj->nk", J, covariance, J)) * 1e3


def write(path, names, numbers, nests):
    rows = [
        ",".join([*(f"{v:.10f}" for v in row), n]) for row, n in zip(numbers, nests, strict=True)
    ]
    path.write_text("\n".join([",".join(names), *rows]) + "\n")


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_predicted_nest_is_as_sure_as_all_that_was_fitted_makes_it(call, cell, tmp_path, command):
    folder, expected = cell
    assert call(command, folder, "--out", tmp_path)[0] == 0
    poses, out = folder / "poses.csv", tmp_path / "predicted.csv"
    assert call("predict", tmp_path / "model.yaml", poses, "--out", out)[0] == 0
    with out.open() as file:
        stated = [[float(row[f"u_{axis}_mm"]) for axis in "xyz"] for row in csv.DictReader(file)]
    np.testing.assert_allclose(stated, expected, rtol=0.02)


def test_at_a_new_station_the_nests_found_there_have_their_own_uncertainty(call, cell, tmp_path):
    folder, known = cell
    assert call("identify", folder, "--out", tmp_path / "learnt")[0] == 0
    model = tmp_path / "learnt" / "model.yaml"
    assert call("station", model, folder, "--out", tmp_path / "there")[0] == 0
    poses, out = folder / "poses.csv", tmp_path / "predicted.csv"
    assert call("predict", tmp_path / "there" / "model.yaml", poses, "--out", out)[0] == 0
    with out.open() as file:
        stated = [[float(row[f"u_{axis}_mm"]) for axis in "xyz"] for row in csv.DictReader(file)]
    # What links and frames have in common in the rows of the first station is given up.
    assert (np.array(stated) > 0.3 * known).all()
    assert (np.array(stated) < 10 * known).all()
