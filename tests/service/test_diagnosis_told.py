"""What `robocal diagnose` tells a person, at the terminal and in report.html."""

import csv
from pathlib import Path


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
