"""Positions, poses and lengths, held out or not: each counts for what was measured, and no more."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from tests.measured_cell import CAMPAIGN, SIGMA_MM, true_cell, write_bundle
from tests.robocal.diagnosis.hidden_cases import run_diagnose

ROBOT = "ur10e"
HELD_OUT = "held_out: {column: split}\n"
ANCHOR_M = np.array([2.0, 0.5, 0.8])


@pytest.fixture
def measured(tmp_path):
    """Write a bundle whose joints and tool are off as told; every fourth row is a check."""

    def write(joints=lambda q: None, slips=(), kinds=("pose",), rows=120, held_out=HELD_OUT):
        folder, cell = tmp_path / "bundle", true_cell(ROBOT, 5)
        write_bundle(folder, ROBOT, cell, rows)
        with (folder / "measurements.csv").open(newline="") as file:
            table = list(csv.DictReader(file))
        rng = np.random.default_rng(3)
        for index, row in enumerate(table):
            q = np.radians([[float(row[f"j{joint}_deg"]) for joint in range(1, 7)]])
            joints(q)
            tool = cell.true.tool.copy()
            tool[:3, 3] += sum((np.array(by) for line, by in slips if index >= line - 2), 0.0)
            place = replace(cell.true, tool=tool).poses(q)[0, :3, 3]
            kind = kinds[index % len(kinds)]
            noise = rng.normal(size=4) * SIGMA_MM * 1e-3
            row |= {
                f"{axis}_mm": f"{v:.6f}"
                for axis, v in zip("xyz", (place + noise[:3]) * 1e3, strict=True)
            }
            length = np.linalg.norm(place - ANCHOR_M) + noise[3]
            row["distance_mm"] = f"{length * 1e3:.6f}" if kind == "length" else ""
            if kind != "pose":
                row |= dict.fromkeys(("qw", "qx", "qy", "qz"), "")
            if kind == "length":
                row |= dict.fromkeys(("x_mm", "y_mm", "z_mm"), "")
            row["split"] = "check" if index % 4 == 3 else "fit"
        with (folder / "measurements.csv").open("w", newline="") as file:
            out = csv.DictWriter(file, table[0])
            out.writeheader()
            out.writerows(table)
        anchor = ", ".join(f"{v * 1e3:g}" for v in ANCHOR_M)
        lengths = f"anchor: {{xyz_mm: [{anchor}]}}\n" if "length" in kinds else ""
        (folder / "campaign.yaml").write_text(CAMPAIGN + held_out + lengths)
        return folder

    return write


@pytest.fixture
def diagnosed(call, tmp_path):
    """Diagnose a bundle; give what is in diagnosis.json."""

    def diagnose(bundle):
        run_diagnose(call, bundle, tmp_path / "out")
        return json.loads((tmp_path / "out" / "diagnosis.json").read_text())

    return diagnose


def reduced_chi_square(call, bundle, out):
    status, _, complaint = call("identify", bundle, "--out", out)
    assert (status, complaint) == (0, "")
    return json.loads((out / "identification.json").read_text())["adequacy"]["reduced_chi_square"]


def test_what_a_row_lacks_counts_for_nothing(call, measured, diagnosed, tmp_path):
    bundle = measured(kinds=("pose", "position", "length"))
    found = diagnosed(bundle)
    assert found["verdict"] == "model_adequate"
    again = reduced_chi_square(call, bundle, tmp_path / "identified")
    assert found["adequacy"]["reduced_chi_square"] == pytest.approx(again, rel=0.02)


def test_the_gain_of_lengths_is_that_of_lengths(measured, diagnosed):
    found = diagnosed(measured(kinds=("length",)))
    assert SIGMA_MM < found["noise_floor_mm"] < 2 * SIGMA_MM
    assert 0.5 < found["over_noise_floor"] < 3.0


def test_where_no_row_is_held_out_every_one_is_predicted_by_the_others(measured, diagnosed):
    found = diagnosed(measured(kinds=("position",), rows=16, held_out="held_out: {fraction: 0}\n"))
    # Sixteen poses leave little over: the residuals of the fit itself are below the noise.
    assert found["gain"]["held_out_rms_before_mm"] > found["noise_floor_mm"]


def test_a_target_that_slips_twice_is_explained(measured, diagnosed):
    slips = ((42, (0.2e-3, 0, 0)), (92, (0, 0.2e-3, 0)))
    found = diagnosed(measured(slips=slips, kinds=("position",)))
    assert found["verdict"] == "explained"
    assert [effect["effect"] for effect in found["effects"]] == ["tool_step", "tool_step"]
    assert found["depends_on"] == []


def test_no_effect_enters_the_model_twice(measured, diagnosed):
    def geared(q):
        q[0, 2] = q[0, 2] * (1 + 1.5e-3) + 1.2e-4 * np.cos(q[0, 2] + 1.0)

    found = diagnosed(measured(joints=geared, kinds=("position",)))
    (gain,) = (e for e in found["effects"] if e["effect"] == "encoder_gain")
    assert gain["joint"] == 3
    assert "encoder_gain" not in {form["effect"] for form in gain["form_corrections"]}
    assert gain["explained_fraction"] > 0.9


def test_poses_of_an_earlier_diagnosis_do_not_stay_beside_a_new_one(measured, diagnosed, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "next_poses.csv").write_text("j1_deg\n0\n")
    assert diagnosed(measured(kinds=("position",)))["next_poses"] is None
    assert not (tmp_path / "out" / "next_poses.csv").exists()
