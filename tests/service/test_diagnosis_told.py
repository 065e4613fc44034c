"""What `robocal diagnose` tells a person, at the terminal and in report.html."""

import csv
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

from robocal.diagnosis.gain import Gain
from service.report_lines import change_text
from service.web.forms import payload_field
from service.web.rendering import page

CHANGES = {
    "75% less (95 %: 63% to 85%)": (0.75, (0.63, 0.85)),
    "0% less (95 %: 0% to 0%)": (0.0, (-0.001, 0.0)),
    "0% less (95 %: -2% to 1%)": (-0.001, (-0.02, 0.01)),
    "1% more (95 %: -2% to 3%)": (-0.01, (-0.03, 0.02)),
    "115% more (95 %: 80% to 150%)": (-1.15, (-1.5, -0.8)),
}
"""How a share by which the error fell is told, with its interval."""
ON_THE_PAGE = {
    "75 % less (95 %: 63 to 85 %)": (0.75, (0.63, 0.85)),
    "0 % less (95 %: −2 to 1 %)": (-0.001, (-0.02, 0.01)),
    "1 % more (95 %: −2 to 3 %)": (-0.01, (-0.03, 0.02)),
    "115 % more (95 %: 80 to 150 %)": (-1.15, (-1.5, -0.8)),
}


def multiply(bundle: Path, columns: tuple[str, ...], factor: float) -> None:
    """Columns of measurements.csv in another unit."""
    file = bundle / "measurements.csv"
    rows = list(csv.DictReader(file.read_text().splitlines()))
    for row in rows:
        row.update({name: f"{float(row[name]) * factor:.9g}" for name in columns})
    with file.open("w", newline="") as target:
        writer = csv.DictWriter(target, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def test_a_mended_fault_of_the_data_is_told_at_the_terminal_as_in_the_report(
    call, bundle, tmp_path
):
    multiply(bundle, ("x_mm", "y_mm", "z_mm"), 1.0 / 25.4)
    status, printed, complaint = call("diagnose", bundle, "--out", tmp_path / "out")
    told = "x_mm, y_mm, z_mm are in inches: multiply by 25.4 (mended before the diagnosis)"
    assert (status, complaint) == (0, "")
    assert told in printed.splitlines()
    assert told in (tmp_path / "out" / "report.html").read_text()


@pytest.mark.parametrize("told", CHANGES)
def test_an_error_that_grew_is_told_as_so_much_more(told):
    fell, interval = CHANGES[told]
    assert change_text(Gain(1.0, 1.0 - fell, interval, 40)) == told


def on_the_page(fell=0.5, interval=(0.4, 0.6), asks=False, payload_kg=None) -> str:
    """The diagnosis of a campaign without causes."""
    found = {
        "verdict": "Explained",
        "before": 0.1,
        "after": 0.1 * (1.0 - fell),
        "floor": 0.05,
        "reduction": fell,
        "low": interval[0],
        "high": interval[1],
        "causes": [],
        "more": 0,
        "remains": [],
        "faults": [],
        "between": None,
        "hidden": [],
    }
    campaign = SimpleNamespace(id=1, cell="c1")
    payload = None if payload_kg is None else payload_field(payload_kg)
    shown = {"found": found, "verdict": "explained", "plot": "", "plots": [], "asks": asks}
    answer = page("part_diagnosis.html", campaign=campaign, payload=payload, **shown)
    return bytes(answer.body).decode()


@pytest.mark.parametrize("told", ON_THE_PAGE)
def test_the_page_tells_it_alike(told):
    assert told in on_the_page(*ON_THE_PAGE[told])


@pytest.mark.parametrize(("held", "value"), [(0.0, "0"), (2.5, "2.5")])
def test_the_page_asks_what_the_arm_holds_in_the_poses_that_follow(held, value):
    shown = on_the_page(asks=True, payload_kg=held)
    (field,) = re.findall('<input id="follow-up-payload_kg".*?>', shown, re.DOTALL)
    assert re.findall('value="(.*?)"', field) == [value]


def test_the_page_asks_for_no_payload_that_nothing_could_be_compared_with():
    shown = on_the_page(asks=True)
    assert "follow-up" in shown
    assert "follow-up-payload" not in shown
