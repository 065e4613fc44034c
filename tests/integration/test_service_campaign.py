"""The whole way through HTTP: campaign, identification, candidate, verification, release."""

import csv
import io
import json
import math
import zipfile

import pytest
from service_cell import (
    ENDED,
    START_DEG,
    emulated_world,
    installation,
    poses_about_start,
    wait_until,
)

from robocal.formats.bundle import read_bundle

COUNT, TARGETS = 30, 8


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    with emulated_world(tmp_path_factory.mktemp("world")) as running:
        yield running


@pytest.fixture(scope="module")
def site(tmp_path_factory, world):
    with installation(tmp_path_factory.mktemp("site")) as running:
        running.make_cell(world)
        yield running


@pytest.fixture(scope="module")
def calibrated(site):
    """A finished calibration of planned poses."""
    number = site.start_campaign(COUNT)
    shown = site.await_state(number, *ENDED, "paused")
    assert shown["state"] == "finished", shown
    return number


@pytest.fixture(scope="module")
def verified(site, calibrated):
    """A finished verification of its candidate."""
    site.post("/cells/c1/arm")
    number = site.start_campaign(TARGETS, kind="verify")
    shown = site.await_state(number, *ENDED, "paused")
    assert shown["state"] == "finished", shown
    return number


def test_the_cell_is_found_and_checked(site):
    found = site.post("/cells/c1/check").json()
    assert found["ok"] is True
    assert "6 joints" in found["robot"]["detail"]


def test_every_planned_pose_is_measured_once_at_the_first_attempt(site, calibrated):
    rows = site.get(f"/campaigns/{calibrated}/measurements").json()["rows"]
    assert [row["pose"] for row in rows] == list(range(COUNT))
    assert {row["attempt"] for row in rows} == {1}
    for row in rows:
        for joint in range(1, 7):
            assert row[f"j{joint}_deg"] == pytest.approx(row[f"cmd{joint}_deg"], abs=0.05)
            assert row[f"approach{joint}"] in (-1, 0, 1)
        assert row["settle_s"] >= 0.2
        assert math.hypot(*(row[f"q{part}"] for part in "wxyz")) == pytest.approx(1, abs=1e-6)
        assert min(row[f"{part}_s"] for part in ("motion", "settling", "measuring")) >= 0


def test_every_joint_comes_into_half_of_the_poses_from_either_side(site, calibrated):
    rows = site.get(f"/campaigns/{calibrated}/measurements").json()["rows"]
    for joint in range(1, 7):
        assert sum(row[f"approach{joint}"] for row in rows) == 0


def test_the_time_of_the_rows_runs_on_the_clock_of_the_robot(site, calibrated):
    rows = site.get(f"/campaigns/{calibrated}/measurements").json()["rows"]
    times = [row["t_s"] for row in rows]
    assert times[0] == 0
    assert times == sorted(times)
    # The world's clock runs sixty times faster than the one on the wall.
    on_the_wall = sum(
        row[f"{part}_s"]
        for row in rows[1:]
        for part in ("motion", "settling", "measuring", "overhead")
    )
    assert times[-1] == pytest.approx(60 * on_the_wall, rel=0.3)


def test_the_csv_and_the_bundle_hold_what_the_json_holds(site, calibrated, tmp_path):
    text = site.get(f"/campaigns/{calibrated}/measurements", headers={"Accept": "text/csv"}).text
    rows = site.get(f"/campaigns/{calibrated}/measurements").json()["rows"]
    read = list(csv.DictReader(io.StringIO(text)))
    assert [float(row["x_mm"]) for row in read] == [row["x_mm"] for row in rows]
    content = site.get(f"/campaigns/{calibrated}/bundle").content
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(tmp_path)
        assert archive.read("measurements.csv").decode() == text
    bundle = read_bundle(tmp_path)
    assert len(bundle.measurements) == COUNT
    identification = site.get(f"/campaigns/{calibrated}/identification").json()
    assert identification["bundle_sha256"] == bundle.sha256


def test_the_identification_has_the_shape_of_the_contract(site, calibrated):
    document = site.get(f"/campaigns/{calibrated}/identification").json()
    for name in ("parameters", "base", "tool", "rank", "condition", "strategy", "iterations"):
        assert name in document
    assert {"fit", "held_out", "before"} <= set(document["residuals"])
    for row in document["parameters"]:
        assert {"name", "unit", "nominal", "identified", "std", "status"} <= set(row)
    before = document["residuals"]["before"]["position_rms_mm"]
    after = document["residuals"]["held_out"]["position_rms_mm"]
    assert after < 0.2 < before


def test_the_base_that_the_world_hides_is_found(site, world, calibrated):
    hidden = world.ask("truth")["base"]["xyz_mm"]
    found = site.get(f"/campaigns/{calibrated}/identification").json()["base"]["xyz_mm"]
    # Base position trades against the first link, so millimetres are all that can be asked.
    assert found == pytest.approx(hidden, abs=5)


def test_the_first_uncertainty_is_there_with_its_draws(site, calibrated):
    document = site.get(f"/campaigns/{calibrated}/uncertainty").json()
    assert document["draws"] >= 10_000
    assert document["budget"]
    assert 0 < document["tool_position"]["U95_mean_mm"] < 1


def test_the_campaign_disarms_its_cell_at_the_end(site, calibrated):
    shown = site.campaign(calibrated)
    assert (shown["done"], shown["total"], shown["remaining_s"]) == (COUNT, COUNT, 0)
    assert shown["finished"] > shown["started"] > shown["created"]
    answer = site.post("/campaigns", {"cell": "c1", "kind": "calibrate", "poses": 1, "settle_s": 0})
    assert answer.status_code == 409


def test_the_events_replay_every_reading_and_resume_behind_the_last_seen(site, calibrated):
    events = _events(site.get(f"/campaigns/{calibrated}/events").text)
    readings = [entry for entry in events if entry["event"] == "reading"]
    assert [json.loads(entry["data"])["pose"] for entry in readings] == list(range(COUNT))
    final = json.loads(events[-1]["data"])
    assert (events[-1]["event"], final["state"]) == ("progress", "finished")
    ids = [int(entry["id"]) for entry in events]
    assert ids == sorted(ids)
    seen = readings[9]["id"]
    rest = _events(
        site.get(f"/campaigns/{calibrated}/events", headers={"Last-Event-ID": seen}).text
    )
    assert [entry["id"] for entry in rest] == [
        entry["id"] for entry in events if entry["id"] in {other["id"] for other in events[10:]}
    ]
    over = site.get(f"/campaigns/{calibrated}/events", headers={"Last-Event-ID": str(ids[-1])})
    assert over.status_code == 204


def test_compensated_poses_are_reached_better_than_nominal_ones(site, verified):
    rows = site.get(f"/campaigns/{verified}/measurements").json()["rows"]
    assert [row["purpose"] for row in rows] == ["nominal", "compensated"] * TARGETS
    document = site.get(f"/campaigns/{verified}/verification").json()
    for side in ("before", "after"):
        assert {"position_rms_mm", "position_mean_mm", "position_max_mm"} <= set(document[side])
    assert document["after"]["position_rms_mm"] < 0.25 * document["before"]["position_rms_mm"]


def test_the_verification_states_iso_9283_figures_and_its_verdict(site, verified):
    document = site.get(f"/campaigns/{verified}/verification").json()
    figures = document["iso_9283"]
    assert len(figures["poses"]) == TARGETS
    # One visit a pose: AP is the distance itself, and nothing is known of RP.
    assert figures["AP_p_max_mm"] == pytest.approx(document["after"]["position_max_mm"])
    assert figures["RP_l_mean_mm"] is None
    assert document["criterion"]["pose_accuracy_max_mm"] == 0.5
    assert document["targets_seen_by_fit"] == []
    assert document["fitted_rows"] == COUNT
    assert (document["passed"], document["reasons"]) == (True, [])


def test_the_verification_moves_the_candidate_on_and_the_history_names_its_readings(site, verified):
    shown = site.get("/cells/c1/parameters?version=1").json()
    assert shown["state"] == "verified"
    verification, computation = site.get("/cells/c1/parameters/history").json()["history"]
    assert (verification["event"], verification["campaign"]) == ("verified", verified)
    assert computation["event"] == "computed"
    assert computation["origin"]["bundle_sha256"] == shown["provenance"]["bundle_sha256"]
    assert verification["origin"]["bundle_sha256"] != computation["origin"]["bundle_sha256"]
    assert computation["origin"]["seed"] == site.campaign(computation["campaign"])["seed"]


def test_the_candidate_is_released_and_read_by_the_mes(site, verified, calibrated):
    assert site.get("/cells/c1/parameters").status_code == 404
    candidate = site.get("/cells/c1/parameters?state=candidate").json()
    assert candidate["provenance"]["campaign"] == calibrated
    assert site.campaign(verified)["parameters_version"] == candidate["version"] == 1
    assert site.post("/cells/c1/parameters/1/release").status_code == 200
    released = site.get("/cells/c1/parameters")
    assert released.json()["parameters"] == candidate["parameters"]
    again = site.get("/cells/c1/parameters", headers={"If-None-Match": released.headers["ETag"]})
    assert again.status_code == 304


def test_a_criterion_that_is_not_met_leaves_the_version_as_it_is_and_says_why(site, verified):
    site.post("/cells/c1/arm")
    strict = {"pose_accuracy_mean_mm": 0.001, "pose_accuracy_max_mm": 0.5, "poses": 2}
    number = site.start_campaign(2, kind="verify", repeats=3, criterion=strict)
    assert site.await_state(number, *ENDED, "paused")["state"] == "finished"
    document = site.get(f"/campaigns/{number}/verification").json()
    assert document["passed"] is False
    assert "the criterion allows 0.001 mm" in document["reasons"][0]
    assert document["iso_9283"]["visits"] == 3
    # Three visits of an arm that repeats to 0.01 mm, seen by a tracker of 0.015 mm.
    assert 0.005 < document["iso_9283"]["RP_l_mean_mm"] < 0.2
    step = site.get("/cells/c1/parameters/history").json()["history"][0]
    assert (step["event"], step["campaign"]) == ("verification_failed", number)


def test_the_bundle_imported_again_gives_the_same_parameters(site, calibrated):
    content = site.get(f"/campaigns/{calibrated}/bundle").content
    answer = site.client.post("/campaigns/import", content=content)
    assert answer.status_code == 202
    number = answer.json()["id"]
    assert site.await_state(number, *ENDED)["state"] == "finished"
    first = site.get(f"/campaigns/{calibrated}/identification").json()
    second = site.get(f"/campaigns/{number}/identification").json()
    assert second["parameters"] == first["parameters"]


def test_three_poses_for_thirty_parameters_fail_with_one_sentence(site, calibrated):
    site.post("/cells/c1/arm")
    number = site.start_campaign(poses_about_start(3))
    shown = site.await_state(number, *ENDED)
    assert shown["state"] == "failed"
    # Too few poses, or none where the way from the robot's last pose is blocked.
    assert "parameters" in shown["reason"] or "tool_x" in shown["reason"]
    assert "\n" not in shown["reason"]
    assert "Traceback" not in shown["reason"]


def drive_home(world):
    """Where a straight move leads to every pose about the start."""
    home = [math.radians(q) for q in START_DEG]
    world.ask("move", joints=home, speed=100.0, acceleration=1e4)
    wait_until(lambda: not world.ask("robot")["moving"], 20)


def test_repeats_drive_the_whole_series_again(site, world, calibrated):
    drive_home(world)
    site.post("/cells/c1/arm")
    number = site.start_campaign(poses_about_start(3), repeats=2)
    site.await_state(number, *ENDED)
    rows = site.get(f"/campaigns/{number}/measurements").json()["rows"]
    visits = [(row["repeat"], row["pose"]) for row in rows]
    assert visits == [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)]


def _events(text: str) -> list[dict[str, str]]:
    blocks = [block for block in text.split("\n\n") if block and not block.startswith(":")]
    return [dict(line.split(": ", 1) for line in block.split("\n")) for block in blocks]
