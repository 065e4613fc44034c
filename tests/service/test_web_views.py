"""What a person sees before and while the robot moves, against an arm computed elsewhere."""

import numpy as np
import pytest

from service.access.scopes import WHO_MAY, Scope
from service.campaigns.arm_now import arm_now
from service.db.models import CampaignRow, WhereaboutsRow
from service.web import live_view
from tests.elementary_kinematics import frame, load_arm
from tests.service.test_readings import reading

ARM = load_arm("ur10e")
TARGET = frame([0.05, 0.03, 0.1, 0, 0, 0])
"""Where a cell that says nothing has its target."""


def plan(site, poses: int = 14, seed: int = 5) -> dict:
    answer = site.get(f"/parts/cells/c1/plan?poses={poses}&seed={seed}")
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_the_drawn_arm_ends_where_the_target_is_and_keeps_its_links(site, cell):
    shown = plan(site)
    q = np.radians(shown["joints"])
    assert np.all((q >= ARM.limits[:, 0]) & (q <= ARM.limits[:, 1]))
    lines = np.array(shown["arms_mm"], dtype=float)
    assert len(lines) == 13 * shown["frames_a_move"] + 1
    tips = 1e3 * ARM.within(np.eye(4), TARGET).poses(q)[:, :3, 3]
    # Joints are shown in hundredths of a degree, points in whole millimetres.
    assert np.abs(tips - lines[:: shown["frames_a_move"], -1]).max() < 1.0
    lengths = np.linalg.norm(np.diff(lines, axis=1), axis=2)
    # Both ends of a link are rounded to a whole millimetre in three directions.
    assert np.ptp(lengths, axis=0).max() < 2 * np.sqrt(3.0)


def test_another_seed_plans_other_poses(site, cell):
    assert plan(site)["joints"] != plan(site, seed=6)["joints"]


def test_a_robot_that_reaches_below_its_base_is_planned_without_a_floor(site, client, cell):
    robot = cell["robot"] | {"model": "abb_irb910sc"}
    client.post("cells", json=cell | {"name": "scara", "robot": robot})
    address = "/parts/cells/scara/plan?poses=12&seed=1"
    refused = site.get(address)
    assert refused.status_code == 422
    said = refused.json()["detail"]
    assert "no plan of 12 poses: " in said
    assert "Most is removed by floor: set it lower, or state no floor" in said
    client.patch("cells/scara", json={"limits": {"floor_mm": None}})
    assert len(site.get(address).json()["joints"]) == 12


def test_more_poses_than_a_person_looks_at_are_not_drawn(site, cell):
    answer = site.get("/parts/cells/c1/plan?poses=201&seed=1")
    assert answer.status_code == 422
    assert "at most 200" in answer.json()["detail"]


def test_planning_for_a_picture_takes_more_than_the_right_to_read():
    assert WHO_MAY["GET /parts/cells/{name}/plan"] is Scope.operate


def notes(site, kind: str = "calibrate", poses: int = 40) -> dict[str, str]:
    found = site.get(f"/parts/cells/c1/check?kind={kind}&poses={poses}").json()
    return {note["key"]: note["tone"] for note in found}


def test_the_form_says_what_the_service_would_refuse_before_it_is_sent(site, client, cell):
    assert notes(site) == {"check_enough": "good"}
    client.post("cells/c1/disarm")
    assert notes(site) == {"check_not_armed": "caution", "check_enough": "good"}
    assert notes(site, poses=3)["check_too_few"] == "bad"
    assert notes(site, "verify")["check_nothing_to_verify"] == "bad"
    client.post("cells/c1/arm")
    refused = client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 3})
    assert refused.status_code == 422
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 40})
    assert notes(site)["check_busy"] == "caution"


def test_nothing_is_refused_that_the_form_calls_enough(site, client, cell):
    fewest = next(
        count for count in range(1, 60) if "check_too_few" not in notes(site, poses=count)
    )
    body = {"cell": "c1", "kind": "calibrate"}
    assert client.post("campaigns", json=body | {"poses": fewest - 1}).status_code == 422
    assert client.post("campaigns", json=body | {"poses": fewest}).status_code == 202


@pytest.fixture
def measured(client, cell, database):
    """Twelve readings of a nominal robot, the last of them 2 mm off."""
    rng = np.random.default_rng(4)
    q = ARM.draw(rng, 12, widest=2.0)
    poses = [{f"j{i}_deg": float(v) for i, v in enumerate(np.degrees(row), 1)} for row in q]
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": poses})
    base, tool = frame([1.0, -2.0, 0.3, 0.7, -0.1, 0.2]), frame([0.02, -0.03, 0.15, 0.3, 0.1, 0])
    positions = ARM.within(base, tool).poses(q)[:, :3, 3]
    positions[-1, 2] += 0.002

    def measure(count: int) -> None:
        with database.write() as session:
            for idx in range(count):
                session.add(
                    reading(
                        idx,
                        joints=q[idx].tolist(),
                        position=positions[idx].tolist(),
                        attempt=2 if idx == 3 else 1,
                    )
                )

    return measure


def test_residuals_of_a_robot_that_is_nominal_are_nothing(site, measured):
    measured(11)
    seen = site.get("/parts/campaigns/1/live").json()
    assert seen["residuals"]["identified"] is False
    assert seen["residuals"]["pose"] == list(range(11))
    assert max(seen["residuals"]["mm"]) < 1e-3


def test_the_reading_that_is_off_has_the_residual(site, measured):
    measured(12)
    seen = site.get("/parts/campaigns/1/live").json()
    assert int(np.argmax(seen["residuals"]["mm"])) == 11
    # Nine unknowns of twelve readings take a part of it.
    assert 0.5 < seen["residuals"]["mm"][11] < 2.0
    assert seen["sensors"]["visits_again"] == 1


def test_a_restored_campaign_of_the_same_number_is_another(site, measured, database):
    measured(3)
    before = site.get("/parts/campaigns/1/live").json()
    with database.write() as session:
        session.merge(WhereaboutsRow(campaign=1, joints=[0.0] * 6))
        row = session.get_one(CampaignRow, 1)
        told = arm_now(session, row)
        # What a restore may leave: another robot and moment under the same number and revision.
        row.created = "2020-02-02T00:00:00.000+00:00"
        row.cell_document = row.cell_document | {
            "robot": row.cell_document["robot"] | {"model": "ur3e"}
        }
    after = site.get("/parts/campaigns/1/live").json()
    assert after["arm_mm"] != before["arm_mm"]
    with database.read() as session:
        assert arm_now(session, session.get_one(CampaignRow, 1)) != told


def test_before_there_are_enough_readings_no_residual_is_shown(site, measured):
    measured(live_view.ENOUGH - 1)
    assert site.get("/parts/campaigns/1/live").json()["residuals"] is None


def test_planned_targets_are_where_the_poses_lead(site, measured):
    tips = site.get("/parts/campaigns/1/tips").json()
    assert tips["pose"] == list(range(12))
    rng = np.random.default_rng(4)
    expected = 1e3 * ARM.within(np.eye(4), TARGET).poses(ARM.draw(rng, 12, widest=2.0))[:, :3, 3]
    assert np.abs(expected - tips["mm"]).max() < 1.0


def test_before_the_first_reading_there_is_nothing_to_watch(site, measured):
    assert site.get("/parts/campaigns/1/live").json() is None


def test_there_is_no_robot_to_watch_where_none_is_known(site):
    assert site.get("/parts/campaigns/7/live").status_code == 404
