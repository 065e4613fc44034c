"""A hidden effect in the cell is found through HTTP; a follow-up measures what is asked for."""

import csv
import io
import zipfile

import pytest
from service_cell import ENDED, emulated_world, installation, wait_until

POSES, FIRST_ROUND, ROUNDS = 30, 6, 2
HIDDEN = {"effect": "joint_compliance", "joint": 2, "compliance_rad_per_nm": 1e-6}
"""So little that 30 poses leave open whether the joint or the base yields."""


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    with emulated_world(tmp_path_factory.mktemp("world"), effects=[HIDDEN]) as running:
        yield running


@pytest.fixture(scope="module")
def site(tmp_path_factory, world):
    with installation(tmp_path_factory.mktemp("site")) as running:
        running.make_cell(world)
        yield running


@pytest.fixture(scope="module")
def calibrated(site):
    """A finished calibration with its diagnosis."""
    number = site.start_campaign(POSES, settle_s=0.1)
    shown = site.await_state(number, *ENDED, "paused")
    assert (shown["state"], shown["reason"]) == ("finished", "")
    return number


@pytest.fixture(scope="module")
def followed(site, calibrated):
    """A finished follow-up of it."""
    site.post("/cells/c1/arm")
    wanted = {"cell": "c1", "kind": "follow_up", "follows": calibrated, "poses": FIRST_ROUND}
    answer = site.post("/campaigns", wanted | {"rounds": ROUNDS, "settle_s": 0.1})
    assert answer.status_code == 202, answer.text
    number = answer.json()["id"]
    shown = site.await_state(number, *ENDED, "paused")
    assert (shown["state"], shown["reason"]) == ("finished", "")
    return number


def causes(document: dict) -> set[tuple[str, int | None]]:
    """Every cause that stands in the stated sets."""
    entries = [
        entry for effect in document["effects"] for entry in (effect, *effect["confusable_with"])
    ]
    return {(entry["effect"], entry.get("joint")) for entry in entries}


def bundle_rows(site, number) -> list[dict[str, str]]:
    with zipfile.ZipFile(io.BytesIO(site.get(f"/campaigns/{number}/bundle").content)) as archive:
        text = archive.read("measurements.csv").decode()
    return list(csv.DictReader(io.StringIO(text)))


def test_the_hidden_effect_is_among_the_stated_causes(site, world, calibrated):
    found = site.get(f"/campaigns/{calibrated}/diagnosis").json()
    assert found["verdict"] == "explained"
    truth = world.ask("truth")["effects"]
    assert len(truth) == 1
    assert "JointCompliance(joint=2" in truth[0]
    assert ("joint_compliance", 2) in causes(found)
    assert found["gain"]["ci95"][0] > 0


def test_what_is_open_is_asked_for_as_poses(site, calibrated):
    found = site.get(f"/campaigns/{calibrated}/diagnosis").json()
    assert found["next_poses"] == "next_poses.csv"
    asked = site.get(f"/campaigns/{calibrated}/next_poses")
    assert asked.headers["content-type"].startswith("text/csv")
    assert len(list(csv.DictReader(io.StringIO(asked.text)))) > FIRST_ROUND


def test_the_report_stands_alone_and_runs_nothing(site, calibrated):
    report = site.get(f"/campaigns/{calibrated}/report")
    assert report.headers["content-type"].startswith("text/html")
    assert "sandbox" in report.headers["content-security-policy"]
    assert "joint_compliance" in report.text
    assert "<script" not in report.text


def test_a_model_that_gains_becomes_a_version_with_its_effects(site, calibrated):
    versions = site.get("/cells/c1/parameters/versions").json()["versions"]
    mine = [v["version"] for v in versions if v["campaign"] == calibrated]
    geometry, extended = (
        site.get(f"/cells/c1/parameters?version={version}").json() for version in sorted(mine)[:2]
    )
    assert geometry["model"]["effects"] == []
    assert extended["model"]["effects"]
    before, after = (
        version["residuals"]["held_out"]["position_rms_mm"] for version in (geometry, extended)
    )
    assert after < before


def test_a_follow_up_goes_round_by_round_and_is_pooled_with_what_it_follows(
    site, calibrated, followed
):
    shown = site.get(f"/campaigns/{followed}").json()
    assert shown["follows"] == calibrated
    assert shown["done"] == shown["total"] >= FIRST_ROUND
    kinds = [
        kind for (kind,) in site.rows(f"SELECT kind FROM job WHERE campaign={followed} ORDER BY id")
    ]
    rounds = kinds.count("diagnose")
    assert kinds == ["collect", "analyse", "diagnose"] * rounds
    assert 1 <= rounds <= ROUNDS
    rows = bundle_rows(site, followed)
    assert len(rows) == POSES + shown["done"]
    assert len({row["pose"] for row in rows}) == len(rows)
    times = [float(row["t_s"]) for row in rows]
    assert times == sorted(times)
    found = site.get(f"/campaigns/{followed}/diagnosis").json()
    assert ("joint_compliance", 2) in causes(found)


def test_the_joints_come_from_the_sides_that_the_diagnosis_asks_for(site, calibrated, followed):
    text = site.get(f"/campaigns/{calibrated}/next_poses").text
    wanted = list(csv.DictReader(io.StringIO(text)))[:FIRST_ROUND]
    driven = bundle_rows(site, followed)[POSES : POSES + FIRST_ROUND]
    sides = [f"approach{joint}" for joint in range(1, 7)]
    same = [
        [float(row[s]) == float(pose[s]) for s in sides]
        for row, pose in zip(driven, wanted, strict=True)
    ]
    # Where a side leaves no room, all joints come from the other one.
    assert all(all(each) or not any(each) for each in same)
    assert any(all(each) for each in same)


def test_the_cell_is_disarmed_when_the_follow_up_is_over(site, followed):
    assert site.get("/cells/c1").json()["armed"] is False


def test_a_result_is_computed_again_with_other_settings(site, calibrated):
    wish = {"strategy": "cross", "fix": ["d_4"]}
    asked = site.post(f"/campaigns/{calibrated}/identification", wish)
    assert asked.status_code == 202, asked.text
    where = f"/campaigns/{calibrated}/computations/{asked.json()['id']}"
    wait_until(lambda: site.get(where).json()["state"] == "done", period_s=0.1)
    again = site.get(f"/campaigns/{calibrated}/identification").json()
    assert again["strategy"] == "cross"
    held = {entry["name"]: entry["status"] for entry in again["parameters"]}
    assert held["d_4"] == "fixed"
    assert site.get(f"/campaigns/{calibrated}").json()["state"] == "finished"


def test_a_computation_that_cannot_be_done_says_why(site, calibrated):
    asked = site.post(f"/campaigns/{calibrated}/identification", {"fix": ["d_9"]})
    where = f"/campaigns/{calibrated}/computations/{asked.json()['id']}"
    wait_until(lambda: site.get(where).json()["state"] == "failed", period_s=0.1)
    assert "d_9" in site.get(where).json()["reason"]


def test_a_follow_up_without_an_open_question_is_refused(site, calibrated):
    site.post("/cells/c1/arm")
    nobody = {"cell": "c1", "kind": "follow_up", "follows": 999}
    assert site.post("/campaigns", nobody).status_code == 404
    unsaid = site.post("/campaigns", {"cell": "c1", "kind": "follow_up"})
    assert unsaid.status_code == 422
    assert "follows" in unsaid.json()["detail"]
    site.post("/cells/c1/disarm")
