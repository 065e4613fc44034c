"""How sure a nest's place is, against normal equations from elementary matrices alone."""

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from robocal.identification.priors import PRIOR_ANGLE, PRIOR_LENGTH
from tests.elementary_kinematics import ROBOTS, Arm, turn
from tests.measured_cell import CAMPAIGN, position_sigma, true_cell

PLACES = {"n1": (0.06, -0.04, 0.12), "n2": (-0.08, 0.05, 0.10), "n3": (0.02, 0.09, 0.16)}
POSES = 14
STEP = 1e-6
N_LINKS, N_BASE = 30, 6
NOWHERE, EXACTLY = 10.0, 1e-9
"""Prior of what nothing is known of, and of what is stated [m, rad]"""


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


@dataclass(frozen=True)
class Measured:
    """A bundle, and by elementary matrices what its rows and its predicted nests depend on."""

    folder: Path
    J: np.ndarray
    """Whitened scalar of a row, unknown."""
    prior: np.ndarray
    J_asked: np.ndarray
    """Pose, axis, unknown."""

    @property
    def covariance(self) -> np.ndarray:
        """Of all unknowns, by the normal equations."""
        return np.linalg.inv(self.J.T @ self.J + np.diag(self.prior**-2.0))


@pytest.fixture(scope="module", params=[(), ("n3",), tuple(PLACES)], ids=len)
def cell(request, tmp_path_factory):
    """A bundle of three nests, the places of some stated, and how sure its nests can be [mm]."""
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
    stated = "".join(
        f"  {name}: {{xyz_mm: {[1e3 * x for x in place]}}}\n"
        if name in request.param
        else f"  {name}: {{}}\n"
        for name, place in PLACES.items()
    )
    settings = f"held_out: {{fraction: 0}}\ntargets:\n{stated}"
    (folder / "campaign.yaml").write_text(CAMPAIGN + settings)
    write(folder / "measurements.csv", [*joints, "x_mm", "y_mm", "z_mm", "target"], table, nests)
    new = cell.nominal.draw(rng, 6, widest=2.5)
    asked = ["n1", "n2", "n3"] * 2
    write(folder / "poses.csv", [*joints, "target"], np.degrees(new), asked)
    J = (jacobian(arm, q, nests) / sigma[:, :, None]).reshape(-1, len(nothing))
    links = [PRIOR_ANGLE, PRIOR_LENGTH, PRIOR_LENGTH, PRIOR_ANGLE, PRIOR_ANGLE] * 6
    nest = [EXACTLY if name in request.param else NOWHERE for name in np.repeat(list(PLACES), 3)]
    prior = np.array([*links, *[NOWHERE] * N_BASE, *nest])
    return Measured(folder, J, prior, jacobian(arm, new, asked))


def write(path, names, numbers, nests):
    rows = [
        ",".join([*(f"{v:.10f}" for v in row), n]) for row, n in zip(numbers, nests, strict=True)
    ]
    path.write_text("\n".join([",".join(names), *rows]) + "\n")


def stated(call, folder, model, out):
    """u_x, u_y, u_z of the poses asked for [mm]."""
    assert call("predict", model, folder / "poses.csv", "--out", out)[0] == 0
    with out.open() as file:
        return [[float(row[f"u_{axis}_mm"]) for axis in "xyz"] for row in csv.DictReader(file)]


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_a_predicted_nest_is_as_sure_as_all_that_was_fitted_makes_it(call, cell, tmp_path, command):
    assert call(command, cell.folder, "--out", tmp_path)[0] == 0
    variance = np.einsum("nki,ij,nkj->nk", cell.J_asked, cell.covariance, cell.J_asked)
    found = stated(call, cell.folder, tmp_path / "model.yaml", tmp_path / "predicted.csv")
    np.testing.assert_allclose(found, np.sqrt(variance) * 1e3, rtol=0.02)


def test_at_a_new_station_a_nest_is_as_sure_as_links_and_rows_together_make_it(
    call, cell, tmp_path
):
    """Against 2,000 draws of the links and of the new rows' noise: a deviation known to 2 %."""
    assert call("identify", cell.folder, "--out", tmp_path / "learnt")[0] == 0
    model, out = tmp_path / "learnt" / "model.yaml", tmp_path / "there"
    assert call("station", model, cell.folder, "--out", out)[0] == 0
    rng, links = np.random.default_rng(2), slice(0, N_LINKS)
    frames = np.flatnonzero(cell.prior == NOWHERE)
    wrong = rng.multivariate_normal(np.zeros(N_LINKS), cell.covariance[links, links], 2000).T
    seen = rng.normal(size=(len(cell.J), 2000)) - cell.J[:, links] @ wrong
    found = np.linalg.lstsq(cell.J[:, frames], seen)[0]
    off = cell.J_asked[..., links] @ wrong + cell.J_asked[..., frames] @ found
    got = stated(call, cell.folder, out / "model.yaml", tmp_path / "predicted.csv")
    np.testing.assert_allclose(got, off.std(axis=-1) * 1e3, rtol=0.1)


def test_an_older_model_does_not_say_how_sure_a_nest_is(call, cell, tmp_path):
    assert call("identify", cell.folder, "--out", tmp_path)[0] == 0
    document = yaml.safe_load((tmp_path / "model.yaml").read_text())
    del document["covariance"]["nests_with_parameters_coefficients_and_each_other"]
    (tmp_path / "older.yaml").write_text(yaml.safe_dump(document))
    out = tmp_path / "predicted.csv"
    status, _, warned = call(
        "predict", tmp_path / "older.yaml", cell.folder / "poses.csv", "--out", out
    )
    assert (status, "identify the bundle again" in warned) == (0, True)
    with out.open() as file:
        assert {row["u_x_mm"] for row in csv.DictReader(file)} == {""}


@pytest.mark.parametrize(
    ("spoilt", "complaint"),
    [
        ("alpha_7", "field 'covariance.parameters' names 'alpha_7', which is no parameter"),
        ("alpha_3", "field 'covariance.parameters' names 'alpha_3' twice"),
    ],
)
def test_a_model_that_misnames_a_parameter_is_refused_by_that_name(
    call, cell, tmp_path, spoilt, complaint
):
    assert call("identify", cell.folder, "--out", tmp_path)[0] == 0
    path = tmp_path / "model.yaml"
    path.write_text(path.read_text().replace("alpha_2", spoilt, 1))
    out = tmp_path / "predicted.csv"
    status, _, said = call("predict", path, cell.folder / "poses.csv", "--out", out)
    assert (status, complaint in said, out.exists()) == (2, True, False), said
