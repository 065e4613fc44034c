"""`robocal uncertainty`: what it prints and writes, and what it refuses."""

import json

import pytest


def test_it_prints_the_budget_the_tool_and_whether_to_believe_it(call, sound_bundle, tmp_path):
    status, printed, _ = call("uncertainty", sound_bundle, "--out", tmp_path, "--draws", 1000)
    assert status == 0
    for words in (
        "instrument, fixed part",
        "tool position, 48 poses",
        "over the workspace",
        "simulated campaigns fitted again",
        "nothing in the data speaks against",
    ):
        assert words in printed
    document = json.loads((tmp_path / "uncertainty.json").read_text())
    assert document["intervals"]["hold"] is True
    assert document["draws"] == 1000
    assert len(document["poses"]) == 48
    assert document["workspace"]["cubes"]


def test_it_tells_the_tools_uncertainty_at_commanded_poses(call, sound_bundle, tmp_path):
    poses = tmp_path / "poses.csv"
    poses.write_text(
        "j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n10,-60,80,-20,40,5\n0,-90,90,0,30,0\n"
    )
    status, printed, _ = call(
        "uncertainty", sound_bundle, "--poses", poses, "--out", tmp_path, "--draws", 1000,
        "--refits", 0, "--json",
    )  # fmt: skip
    assert status == 0
    document = json.loads(printed)
    assert [row["line"] for row in document["poses"]] == [2, 3]
    assert document["refits"] is None
    assert all(0 < row["U95_mm"] < 1 for row in document["poses"])


def test_its_draws_meet_a_fifth_of_the_tolerance_as_jcgm_101_asks(call, sound_bundle, tmp_path):
    poses = tmp_path / "poses.csv"
    poses.write_text("j1_deg,j2_deg,j3_deg,j4_deg,j5_deg,j6_deg\n10,-60,80,-20,40,5\n")
    status, printed, _ = call(
        "uncertainty", sound_bundle, "--poses", poses, "--out", tmp_path, "--refits", 0,
    )  # fmt: skip
    assert status == 0
    assert "stable to 0.2 of the numerical tolerance of 1 digit(s)" in printed


@pytest.mark.parametrize(
    ("budget", "complaint"),
    [
        ("{target_sigma_mm: -1}", "field 'budget.target_sigma_mm' must not be negative"),
        ("{temperature_sigma_degc: 1}", "field 'budget.expansion_ppm_per_degc' is missing"),
        ("{readings: some}", "field 'budget.readings' must be declared or repeats"),
        ("{target_sigma: 1}", "did you mean 'target_sigma_mm'"),
    ],
)
def test_a_wrong_budget_is_named_by_file_line_and_field(call, bundle, tmp_path, budget, complaint):
    file = bundle / "campaign.yaml"
    file.write_text(file.read_text() + f"budget: {budget}\n")
    status, _, error = call("uncertainty", bundle, "--out", tmp_path)
    assert status == 2
    assert error.startswith("robocal: campaign.yaml line ")
    assert complaint in error
    assert error.count("\n") == 1


def test_scatter_from_repeats_that_are_not_there_is_no_answer(call, bundle, tmp_path):
    file = bundle / "campaign.yaml"
    file.write_text(file.read_text() + "budget: {readings: repeats}\n")
    status, _, error = call("uncertainty", bundle, "--out", tmp_path)
    assert status == 3
    assert "measure repeats or write declared" in error


QUICK = ("--draws", 1000, "--refits", 0, "--json")


def test_a_slip_is_refused_as_identify_does_and_mended_when_asked(call, bundle, tmp_path):
    table = bundle / "measurements.csv"
    head, *rows = table.read_text().splitlines()
    turned = [row.split(",") for row in rows]
    for row in turned:
        row[2] = str(-float(row[2]))
    table.write_text("\n".join([head, *(",".join(row) for row in turned)]) + "\n")
    refused = call("uncertainty", bundle, "--out", tmp_path)
    assert refused[0] == 2
    assert refused == call("identify", bundle, "--out", tmp_path)
    status, printed, _ = call("uncertainty", bundle, "--out", tmp_path, "--mend", *QUICK)
    assert status == 0
    document = json.loads(printed)
    assert document["mended"][0]["columns"] == ["j3_deg"]
    assert document["intervals"]["hold"] is True


def test_it_takes_the_choices_that_identify_takes(call, sound_bundle, tmp_path):
    asked = ("--fix", "a_2", "--free", "d_3", "--prior", "a_3_mm=0.001", "--strategy", "cross")
    status, printed, _ = call("uncertainty", sound_bundle, "--out", tmp_path, *asked, *QUICK)
    assert status == 0
    rows = {row["name"]: row for row in json.loads(printed)["parameters"]}
    assert "a_2" not in rows
    assert rows["d_3"]["status"] == "identified"
    assert 0 < rows["a_3"]["u"] <= 0.001
    identified = json.loads(call("identify", sound_bundle, "--out", tmp_path, *asked, "--json")[1])
    beside = {row["name"]: row["std"] for row in identified["parameters"]}
    for name in ("d_3", "a_3", "theta_2"):
        assert rows[name]["u"] == pytest.approx(beside[name], rel=1e-3)
