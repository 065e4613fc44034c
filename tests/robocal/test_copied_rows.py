"""A row that stands in measurements.csv twice is measured once."""

import json

import pytest

from robocal.formats.bundle import read_bundle
from tests.robocal.diagnosis.hidden_cases import run_diagnose, write_cases


@pytest.fixture
def bundle(tmp_path):
    """Clean rows, each with its time."""
    return write_cases(tmp_path / "cases", "--kind", "clean", "--seed", "307") / "0000"


def pasted(bundle, change=lambda line: line):
    """The file with its first rows once more at the end."""
    path = bundle / "measurements.csv"
    lines = path.read_text().splitlines()
    path.write_text("\n".join([*lines, *(change(line) for line in lines[1:31])]) + "\n")
    return len(lines)


def test_rows_pasted_twice_are_named_and_change_nothing(bundle, call, tmp_path):
    alone = read_bundle(bundle).measurements
    before = run_diagnose(call, bundle, tmp_path / "before")
    length = pasted(bundle)
    assert (read_bundle(bundle).measurements.lines == alone.lines).all()
    run_diagnose(call, bundle, tmp_path / "after")
    document = json.loads((tmp_path / "after" / "diagnosis.json").read_text())
    copies = [row for row in document["rejected_rows"] if row["line"] > length]
    assert len(copies) == 30
    assert copies[0]["reason"] == "a copy of an earlier row, with the same t_s"
    assert "geometry alone explains" in before


def test_an_equal_reading_at_another_moment_is_a_repeat(bundle):
    place = (bundle / "measurements.csv").read_text().splitlines()[0].split(",").index("t_s")

    def later(line):
        cells = line.split(",")
        cells[place] = f"{float(cells[place]) + 1e6:.3f}"
        return ",".join(cells)

    alone = len(read_bundle(bundle).measurements)
    pasted(bundle, later)
    assert len(read_bundle(bundle).measurements) == alone + 30


def test_a_row_that_says_more_than_its_copy_is_kept(bundle):
    place = (bundle / "measurements.csv").read_text().splitlines()[0].split(",").index("payload_kg")

    def emptied(line):
        cells = line.split(",")
        cells[place] = ""
        return ",".join(cells)

    pasted(bundle, emptied)
    assert not [row for row in read_bundle(bundle).rejected if "copy" in row.reason]


def test_equal_readings_are_repeats_where_times_tell_nothing(bundle):
    path = bundle / "measurements.csv"
    lines = path.read_text().splitlines()
    place = lines[0].split(",").index("t_s")

    def at_noon(line):
        cells = line.split(",")
        cells[place] = "0"
        return ",".join(cells)

    path.write_text("\n".join([lines[0], *map(at_noon, lines[1:])]) + "\n")
    pasted(bundle)
    assert read_bundle(bundle).rejected == ()
