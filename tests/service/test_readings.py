"""Readings in the database: written once, shown in the units of the files."""

import csv
import io
import math
import zipfile

import pytest
import yaml
from sqlalchemy import text
from sqlalchemy.exc import DatabaseError, IntegrityError

from service.clock import utc_now
from service.db.models import ReadingRow

POSE = {f"j{joint}_deg": 10.0 * joint for joint in range(1, 7)}


def reading(idx: int = 0, repeat: int = 0, **change) -> ReadingRow:
    values = {
        "campaign": 1,
        "idx": idx,
        "repeat": repeat,
        "revision": 2,
        "attempt": 1,
        "fence": 1,
        "joints": [math.radians(10.0 * joint) for joint in range(1, 7)],
        "commanded": [math.radians(10.0 * joint) for joint in range(1, 7)],
        "position": [0.7, -0.8, 0.9],
        "orientation": [1.0, 0.0, 0.0, 0.0],
        "spread": 1e-5,
        "shots": 1,
        "approach": [1, -1, 0, 1, 1, 1],
        "speed": 0.3,
        "settle_s": 0.5,
        "robot_time_s": 10.0,
        "tracker_time_s": 10.0,
        "t_s": 0.0,
        "motion_s": 1.0,
        "settling_s": 0.5,
        "measuring_s": 0.2,
        "overhead_s": 0.05,
        "created": utc_now(),
    }
    return ReadingRow(**(values | change))


@pytest.fixture
def measured(client, cell, database):
    """Campaign 1 with two poses, the first of them measured."""
    body = {"cell": "c1", "kind": "calibrate", "poses": [POSE, POSE], "seed": 7}
    client.post("campaigns", json=body)
    with database.write() as session:
        session.add(reading())


@pytest.mark.parametrize("change", ["UPDATE reading SET position = '[]'", "DELETE FROM reading"])
def test_a_reading_can_be_neither_changed_nor_deleted(measured, database, change):
    with pytest.raises(DatabaseError, match="never changed"), database.write() as session:
        session.execute(text(change))


def test_a_second_reading_of_the_same_visit_is_refused(measured, database):
    with pytest.raises(IntegrityError), database.write() as session:
        session.add(reading())
    with database.write() as session:
        session.add(reading(idx=1))


def test_a_reading_without_a_planned_pose_is_refused(measured, database):
    with pytest.raises(IntegrityError), database.write() as session:
        session.add(reading(idx=5))


def test_the_csv_has_degrees_and_millimetres_and_json_the_course_besides(client, measured):
    answer = client.get("campaigns/1/measurements", headers={"Accept": "text/csv"})
    assert answer.headers["content-type"].startswith("text/csv")
    (row,) = csv.DictReader(io.StringIO(answer.text))
    assert float(row["j3_deg"]) == pytest.approx(30.0, abs=1e-8)
    assert float(row["cmd6_deg"]) == pytest.approx(60.0, abs=1e-8)
    assert [float(row[name]) for name in ("x_mm", "y_mm", "z_mm")] == [700, -800, 900]
    assert [row[f"approach{joint}"] for joint in (1, 2, 3)] == ["1", "-1", "0"]
    assert row["temperature_degc"] == ""
    (entry,) = client.get("campaigns/1/measurements").json()["rows"]
    assert entry["temperature_degc"] is None
    assert entry["motion_s"] == 1.0
    assert entry["purpose"] == "calibrate"


def test_the_bundle_holds_the_robot_the_instrument_and_the_rows(client, measured):
    answer = client.get("campaigns/1/bundle")
    assert answer.headers["content-type"] == "application/zip"
    with zipfile.ZipFile(io.BytesIO(answer.content)) as archive:
        assert archive.namelist() == ["robot.yaml", "campaign.yaml", "measurements.csv"]
        campaign = yaml.safe_load(archive.read("campaign.yaml"))
        rows = archive.read("measurements.csv").decode()
    assert campaign["held_out"] == {"fraction": 0.25, "seed": 7}
    assert campaign["instrument"] == {
        "kind": "laser_tracker",
        "sigma_mm": 0.015,
        "sigma_ppm": 6.0,
        "sigma_mrad": 0.05,
    }
    assert rows == client.get("campaigns/1/measurements", headers={"Accept": "text/csv"}).text
    assert client.get("campaigns/1/bundle").content == answer.content


def test_the_remaining_time_follows_from_the_readings_so_far(client, measured):
    shown = client.get("campaigns/1").json()
    assert (shown["done"], shown["total"]) == (1, 2)
    assert shown["remaining_s"] == pytest.approx(1.75, abs=0.06)
