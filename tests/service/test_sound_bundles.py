"""A slip of the data stops every way into a fit, with its sentence and nothing stored."""

import csv
import io
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SENTENCE = "measurements.csv: column j3_deg has its sign turned: multiply it by -1"


@pytest.fixture
def turned(bundle) -> Path:
    """A sound bundle in which the sign of joint 3 has been turned."""
    file = bundle / "measurements.csv"
    rows = list(csv.DictReader(file.read_text().splitlines()))
    for row in rows:
        row["j3_deg"] = str(-float(row["j3_deg"]))
    with file.open("w", newline="") as target:
        writer = csv.DictWriter(target, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return bundle


def packed(folder: Path) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for file in folder.iterdir():
            archive.writestr(file.name, file.read_bytes())
    return content.getvalue()


def test_an_import_is_refused_with_the_slip_and_nothing_is_stored(client, turned):
    answer = client.post("campaigns/import", content=packed(turned))
    assert (answer.status_code, answer.json()["detail"]) == (422, SENTENCE)
    assert client.get("campaigns").json()["campaigns"] == []


def test_an_import_of_another_robot_is_refused_too(client, bundle):
    robot = (ROOT / "robocal" / "robots" / "staubli_tx60.yaml").read_text()
    (bundle / "robot.yaml").write_text(robot)
    answer = client.post("campaigns/import", content=packed(bundle))
    assert answer.status_code == 422
    assert "do not fit robot 'staubli-tx60'" in answer.json()["detail"]


def test_a_sound_bundle_is_imported(client, sound_bundle):
    assert client.post("campaigns/import", content=packed(sound_bundle)).status_code == 202


def test_the_analysis_of_a_campaign_fails_with_the_slip(turned):
    (turned / "request.json").write_text('{"date": "2026-01-01T00:00:00+00:00"}')
    with subprocess.Popen(
        [sys.executable, "-m", "service.procedures.numerics", "calibrate", str(turned)],
        stdin=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=ROOT,
        text=True,
    ) as numerics:
        assert numerics.stderr.read() == f"{SENTENCE}\n"
        assert numerics.wait(30) == 2
    assert not (turned / "answer.json").exists()


def test_uncertainty_stops_at_a_slip_and_writes_nothing(call, turned, tmp_path):
    status, printed, complaint = call("uncertainty", turned, "--out", tmp_path / "o")
    assert (status, printed, complaint) == (2, "", f"robocal: {SENTENCE} (--mend does it)\n")
    assert not (tmp_path / "o").exists()


def test_identify_writes_both_files_or_none(call, sound_bundle, tmp_path):
    (tmp_path / "model.yaml").mkdir()
    status, _, complaint = call("identify", sound_bundle, "--out", tmp_path)
    assert status == 2
    assert "model.yaml: cannot be written" in complaint
    assert [path.name for path in tmp_path.iterdir()] == ["model.yaml"]
