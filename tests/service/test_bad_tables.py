"""A measurements.csv that cannot be used: one line naming its line, status 2, no result."""

import re

import numpy as np
import pytest

from tests.spoilt_bundle import (
    assert_refused,
    cell,
    column,
    content,
    edit,
    keep,
    parametrised,
    replaced,
)

TABLE = {
    "unit of a joint": (
        replaced("measurements.csv", "j2_deg", "j2_rad"),
        "measurements.csv line 1: .*'j2_deg' is missing.*j2_rad",
    ),
    "unit of a position": (
        replaced("measurements.csv", "x_mm", "x_m"),
        "measurements.csv line 1: .*x_m'",
    ),
    "missing joint": (
        replaced("measurements.csv", "j6_deg", "note_j"),
        "measurements.csv line 1: column 'j6_deg' is missing.*6 joints",
    ),
    "extra joint": (column("j7_deg", lambda _: "1"), "measurements.csv line 1: .*j7_deg.*6 joints"),
    "missing position": (
        replaced("measurements.csv", "z_mm", "note_z"),
        "measurements.csv line 1: column 'z_mm' is missing",
    ),
    "unknown column": (
        column("temprature_degc", lambda _: "20"),
        "measurements.csv line 1: .*did you mean 'temperature_degc'",
    ),
    "semicolons": (
        edit("measurements.csv", lambda text: text.replace(",", ";")),
        "measurements.csv line 1: has its columns separated by ';': save it as CSV with commas",
    ),
    "semicolons and decimal commas": (
        edit("measurements.csv", lambda text: text.replace(",", ";").replace(".", ",")),
        "measurements.csv line 1: has its columns separated by ';': .* points in the numbers",
    ),
    "tabs": (
        edit("measurements.csv", lambda text: text.replace(",", "\t")),
        "measurements.csv line 1: has its columns separated by tabs: save it as CSV with commas",
    ),
    "speed in percent": (
        column("speed", lambda row: "50" if row == 2 else "1"),
        "measurements.csv line 4: column 'speed' must be a fraction of full speed, from 0 to 1, "
        "not 50",
    ),
    "speed below zero": (
        column("speed", lambda row: "-1" if row == 2 else "0"),
        "measurements.csv line 4: column 'speed' must be .*, not -1",
    ),
    "settled before it stopped": (
        column("settle_s", lambda _: "-1"),
        "measurements.csv line 2: column 'settle_s' must be a time in s, from 0 .*, not -1",
    ),
    "payload that lifts": (
        column("payload_kg", lambda _: "-5"),
        "measurements.csv line 2: column 'payload_kg' must be a mass in kg, from 0 .*, not -5",
    ),
    "payload that nothing carries": (
        column("payload_kg", lambda _: "1e9"),
        "measurements.csv line 2: column 'payload_kg' must be .* to 10000, not 1e.09",
    ),
    "text in a number": (
        cell(7, 3, "12,5".replace(",", ";")),
        "measurements.csv line 7: column 'j4_deg'.*12;5",
    ),
    "one number for all poses": (
        column("pose", lambda _: "3"),
        "measurements.csv: column 'pose' is 3 in every row, but the joints differ",
    ),
    "letters in a number": (cell(49, 8, "abc"), "measurements.csv line 49: column 'z_mm'.*abc"),
    "underscore in a number": (
        cell(9, 6, "1_000.5"),
        "measurements.csv line 9: column 'x_mm'.*1_000.5",
    ),
    "NaN": (cell(3, 0, "NaN"), "measurements.csv line 3: column 'j1_deg'.*NaN"),
    "infinity": (cell(4, 7, "-inf"), "measurements.csv line 4: column 'y_mm'.*inf"),
    "number beyond all numbers": (
        cell(4, 7, "1e999"),
        "measurements.csv line 4: column 'y_mm'.*1e999",
    ),
    "number beyond all ranges": (cell(5, 7, "1e200"), "measurements.csv line 5: .*y_mm.*1e\\+?200"),
    "duplicate header": (
        replaced("measurements.csv", "j2_deg", "j1_deg"),
        "measurements.csv line 1: column 'j1_deg' is there twice",
    ),
    "empty file": (content("measurements.csv", ""), "measurements.csv line 1: has no header"),
    "header only": (keep(0), "measurements.csv: has a header but no rows"),
    "short row": (
        edit("measurements.csv", lambda t: t.replace("\n", ",1\n", 2).replace(",1\n", "\n", 1)),
        "measurements.csv line 2: has 14 cells, the header has 13",
    ),
    "long quote": (cell(5, 0, '"1'), "measurements.csv line \\d+: is not CSV"),
    "quaternion not of length one": (cell(11, 9, "2.0"), "measurements.csv line 11: quaternion"),
    "quaternion of zeros": (
        edit(
            "measurements.csv",
            lambda t: "\n".join(
                re.sub(r"(,[^,]*){4}$", ",0,0,0,0", r) if n == 5 else r
                for n, r in enumerate(t.splitlines())
            ),
        ),
        "measurements.csv line 6: quaternion",
    ),
    "quaternion without qz": (
        replaced("measurements.csv", ",qz", ",note_qz"),
        "measurements.csv line 1: column 'qz' is missing",
    ),
    "another word in split": (
        column("split", lambda row: "fit" if row else "test"),
        "measurements.csv line 2: column 'split' must be fit or check, not 'test'",
    ),
    "hole in split": (
        column("split", lambda row: "fit" if row != 4 else ""),
        "measurements.csv line 6: column 'split'",
    ),
    "everything held out": (column("split", lambda _: "check"), "measurements.csv: .*held out"),
    "pose that is no whole number": (
        column("pose", lambda row: f"{row}.5"),
        "measurements.csv line 2: column 'pose'",
    ),
    "pose beyond all numbers": (
        column("pose", lambda _: "1e30"),
        "measurements.csv line 2: column 'pose'",
    ),
    "approach from nowhere": (
        column("approach2", lambda row: "0" if row else "3"),
        "measurements.csv line 2: column 'approach2'",
    ),
    "3 poses for 30 parameters": (keep(3), "measurements.csv lines? 2.*30 parameters"),
    "5 poses and 1 held out": (keep(5), "measurements.csv lines? 2.*24 numbers for 30 parameters"),
    "the same point at every pose": (
        edit(
            "measurements.csv",
            lambda text: re.sub(r"(?m)^((?:[^,j]*,){6})[^,]*,[^,]*,[^,]*", r"\g<1>1,2,3", text),
        ),
        "measurements.csv: has only 1 point at 48 different poses",
    ),
    "binary file": (
        content("measurements.csv", np.random.default_rng(1).bytes(5000)),
        "measurements.csv: is not UTF-8",
    ),
    "zeros for a file": (content("measurements.csv", bytes(5000)), "measurements.csv"),
    "no measurements": (
        lambda folder: (folder / "measurements.csv").unlink(),
        "measurements.csv: no such file",
    ),
    "measurements as a folder": (
        lambda folder: [
            (folder / "measurements.csv").unlink(),
            (folder / "measurements.csv").mkdir(),
        ],
        "measurements.csv: is not a regular file",
    ),
}


@parametrised(TABLE)
def test_a_wrong_table_is_refused_by_line(call, bundle, tmp_path, spoil, complaint):
    spoil(bundle)
    assert_refused(call, bundle, tmp_path / "out", complaint)


def test_a_bundle_that_is_no_folder_is_named(call, bundle, tmp_path):
    for wrong in (tmp_path / "nowhere", bundle / "robot.yaml"):
        assert_refused(call, wrong, tmp_path / "out", re.escape(str(wrong)))


def test_a_byte_order_mark_is_no_fault(call, bundle, tmp_path):
    for file in ("campaign.yaml", "robot.yaml", "measurements.csv"):
        raw = (bundle / file).read_bytes()
        (bundle / file).write_bytes(b"\xef\xbb\xbf" + raw.replace(b"\n", b"\r\n"))
    status, _, said = call("identify", bundle, "--out", tmp_path / "out")
    assert (status, said) == (0, "")


def test_a_row_without_a_reading_is_named_and_the_rest_is_used(call, bundle, tmp_path):
    for spoil in (cell(5, 2, ""), cell(9, 7, ""), cell(12, 10, "")):
        spoil(bundle)
    status, printed, _ = call("identify", bundle, "--out", tmp_path / "out")
    assert status == 0
    assert "line 5 not used: a joint reading is missing" in printed
    assert "line 9 not used: a coordinate of the position is missing" in printed
    assert "line 12 not used: a part of the quaternion is missing" in printed


@pytest.mark.parametrize("distinct", [1, 2, 3])
def test_the_same_few_poses_again_and_again_give_no_traceback(call, bundle, tmp_path, distinct):
    """Forty rows, but all of them at the same places: an honest rank, or status 3."""

    def repeat(text: str) -> str:
        header, *rows = text.splitlines()
        return "\n".join([header, *(rows[k % distinct] for k in range(40))]) + "\n"

    edit("measurements.csv", repeat)(bundle)
    status, _, said = call("identify", bundle, "--out", tmp_path / "out")
    assert status in (0, 2, 3)
    assert said.count("\n") == (0 if status == 0 else 1)
