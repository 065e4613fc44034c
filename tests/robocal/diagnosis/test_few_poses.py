"""Few poses: priors carry weight, a yielding base and a yielding joint 2 look nearly alike."""

import json
from pathlib import Path

import numpy as np
import pytest

from drivers.emulators import blind_case, dataset
from drivers.emulators.blind_case import Options
from drivers.emulators.campaign_draw import Size
from robocal.diagnosis.catalogue import EFFECTS
from robocal.diagnosis.circumstances import circumstances
from robocal.diagnosis.joint_fit import fit_jointly
from robocal.formats.bundle import read_bundle
from robocal.frames import invert
from robocal.identification.prepared import prepare
from robocal.identification.simultaneous import identify_simultaneously
from robocal.identification.solve import frames_alone, solve

ROBOT = Path(__file__).parents[3] / "robocal" / "robots" / "ur10e.yaml"
FEW = Size(poses=30, repeats=4, check=12)


@pytest.fixture
def bundle(tmp_path, monkeypatch) -> Path:
    """Thirty poses of an arm whose joint 2 yields a little."""
    hidden = {"joint": 2, "compliance_rad_per_nm": 2e-6}
    monkeypatch.setitem(blind_case.SIZES, "joint_compliance", lambda scene: hidden)
    options = Options(seed=1, index=2, kind="one", size=FEW, effect="joint_compliance")
    dataset.write_case(ROBOT, options, tmp_path / "bundle", tmp_path / "truth.json")
    return tmp_path / "bundle"


def test_taking_an_effect_out_leaves_what_a_fit_without_it_leaves(bundle):
    read = read_bundle(bundle)
    ready = prepare(read, read.choices)
    fit_rows = ~ready.rows.held_out
    observed = ready.observe(read, fit_rows)
    start = frames_alone(ready.start, observed, ready.choices, identify_simultaneously)
    solution = solve(start.cell, observed, ready.choices, identify_simultaneously)
    cell = solution.fit.cell
    tool = invert(read.robot.geometry.flange) @ cell.geometry.tool_frame
    base = cell.geometry.base_frame[:3, :3]
    rows = circumstances(read.robot, read.gravity, tool[:3, 3], base, ready.rows)
    rows = rows.rows(np.flatnonzero(fit_rows))
    yielding = EFFECTS["joint_compliance"].instances(rows)[0]
    found = fit_jointly(solution.problem, cell, rows, (yielding,))
    bare = fit_jointly(solution.problem, cell, rows, ())
    # Second order of what the geometry turns by; without the priors' pull it is 5e-3.
    np.testing.assert_allclose(found.without(found.fit, 0).r, bare.fit.r, atol=2e-3)
    assert np.abs(bare.fit.r - found.fit.r).max() > 3.0


def test_the_most_probable_cause_is_the_one_that_is_named(call, bundle, tmp_path):
    assert call("diagnose", bundle, "--out", tmp_path / "out")[0] == 0
    document = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    for entry in document["effects"]:
        assert all(entry["probability"] >= c["probability"] for c in entry["confusable_with"])
    causes = [document["effects"][0], *document["effects"][0]["confusable_with"]]
    assert ("joint_compliance", 2) in {(c["effect"], c.get("joint")) for c in causes}
