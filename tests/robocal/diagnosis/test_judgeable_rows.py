"""One empty cell, or rows out of order, must not turn one cause into another."""

import csv
import json

import pytest

from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases


@pytest.fixture
def warming(tmp_path):
    """Change the rows of a bundle whose links grow with temperature; its folder."""
    case = ("--kind", "one", "--effect", "thermal_expansion", "--seed", "4")
    bundle = write_cases(tmp_path / "cases", *case) / "0000"

    def changed(change):
        with (bundle / "measurements.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        rows = change(rows) or rows
        with (bundle / "measurements.csv").open("w", newline="") as file:
            out = csv.DictWriter(file, rows[0])
            out.writeheader()
            out.writerows(rows)
        return bundle

    return changed


def diagnosed(call, bundle, out):
    printed = run_diagnose(call, bundle, out)
    return printed, json.loads((out / "diagnosis.json").read_text())


def emptied(column, which):
    def change(rows):
        for index, row in enumerate(rows):
            if which(index, row):
                row[column] = ""

    return change


@pytest.mark.parametrize("column", ["temperature_degc", "payload_kg", "t_s"])
def test_a_row_with_an_empty_cell_is_named_and_hides_no_cause(call, warming, tmp_path, column):
    bundle = warming(emptied(column, lambda index, _: index == 20))
    _, found = diagnosed(call, bundle, tmp_path / "out")
    assert [entry["effect"] for entry in found["effects"]] == ["thermal_expansion"]
    reason = f"{column} is empty, which most rows have"
    assert {"line": 22, "reason": reason} in found["rejected_rows"]


def test_a_check_row_that_cannot_be_predicted_counts_for_no_gain(call, warming, tmp_path):
    bundle = warming(emptied("temperature_degc", lambda i, row: row["split"] == "check" and i % 2))
    _, found = diagnosed(call, bundle, tmp_path / "out")
    assert found["over_noise_floor"] > 0.8
    assert found["effects"][0]["effect"] == "thermal_expansion"


def test_a_column_that_few_rows_have_is_told_and_not_used(call, warming, tmp_path):
    bundle = warming(emptied("temperature_degc", lambda index, _: index % 5))
    _, found = diagnosed(call, bundle, tmp_path / "out")
    assert found["hidden"][0].startswith("temperature_degc: only 36 of 178 rows have it")
    assert found["rejected_rows"] == []


def test_a_nest_beside_the_robot_holds_no_payload(call, warming, tmp_path):
    def with_nest(rows):
        for index, row in enumerate(rows):
            row["target"] = "r1" if index % 12 == 5 else ""
            if row["target"]:
                row |= {"payload_kg": "", "x_mm": "100", "y_mm": "200", "z_mm": "300"}

    bundle = warming(with_nest)
    with (bundle / "campaign.yaml").open("a") as file:
        file.write("targets: {r1: {fixed: true}}\n")
    _, found = diagnosed(call, bundle, tmp_path / "out")
    assert not [row for row in found["rejected_rows"] if "payload_kg" in row["reason"]]
    assert [entry["effect"] for entry in found["effects"]] == ["thermal_expansion"]


def test_columns_that_never_meet_in_a_row_are_told(call, warming, tmp_path):
    warming(emptied("temperature_degc", lambda index, _: index % 2))
    bundle = warming(emptied("t_s", lambda index, _: index % 2 == 0))
    status, _, complaint = call("diagnose", bundle, "--out", tmp_path / "out")
    assert status == 2
    assert "has no row to fit with all of t_s, temperature_degc and payload_kg" in complaint


def test_rows_out_of_the_order_of_their_times_are_refused(call, warming, tmp_path):
    bundle = warming(lambda rows: [*rows[:50], rows[51], rows[50], *rows[52:]])
    status, _, complaint = call("diagnose", bundle, "--out", tmp_path / "out")
    assert status == 2
    assert "measurements.csv line 53: t_s lies before that of line 52" in complaint
    assert "sort the file by t_s" in complaint
    assert not (tmp_path / "out" / "diagnosis.json").exists()


def test_many_rows_of_one_reason_are_told_in_one_line(call, warming, tmp_path):
    bundle = warming(emptied("payload_kg", lambda index, _: 10 <= index < 20))
    printed, _ = diagnosed(call, bundle, tmp_path / "out")
    lines = ", ".join(map(str, range(12, 22)))
    assert f"measurements.csv lines {lines} not used: payload_kg is empty" in printed
