import pytest

from service.campaigns.life import WorkersSide
from service.jobs.table_queue import TableQueue

POSE = {f"j{joint}_deg": 10.0 * joint for joint in range(1, 7)}


def start(client, **change):
    return client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8} | change)


def test_a_new_campaign_is_queued_with_all_its_poses_to_do(client, cell):
    answer = start(client, repeats=3, settle_s=0.25)
    assert answer.status_code == 202
    assert answer.json() == {"id": 1, "state": "queued"}
    shown = client.get("campaigns/1").json()
    assert (shown["state"], shown["done"], shown["total"]) == ("queued", 0, 24)
    assert shown["remaining_s"] is None
    assert shown["reason"] == ""
    assert shown["settle_s"] == 0.25


def test_a_cell_that_is_not_armed_gets_no_campaign(client, cell):
    client.post("cells/c1/disarm")
    answer = start(client)
    assert answer.status_code == 409
    assert "not armed" in answer.json()["detail"]
    assert client.get("campaigns").json()["campaigns"] == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"poses": 0}, "poses"),
        ({"poses": []}, "poses"),
        ({"poses": 3}, "poses: 3 cannot determine robot 'ur10e'"),
        ({"poses": 6}, "at least 7, or 12 where"),
        ({"poses": [{"j1_deg": 1.0}]}, "poses.0: has j1_deg; robot"),
        ({"poses": [POSE, POSE | {"j3_deg": 400.0}]}, "poses.1.j3_deg: 400 is outside"),
        ({"poses": [POSE | {"j3_deg": "far"}]}, "j3_deg"),
        ({"repeats": 0}, "repeats"),
        ({"settle_s": -1}, "settle_s"),
        ({"kind": "dance"}, "kind"),
        ({"kind": "health", "poses": 3}, "cannot tell base, tool and joints apart"),
        ({"speed": 1}, "speed"),
    ],
)
def test_a_wrong_field_is_named_and_nothing_is_stored(client, cell, change, words):
    answer = start(client, **change)
    assert answer.status_code == 422
    assert words in answer.json()["detail"]
    assert client.get("campaigns").json()["campaigns"] == []


def test_poses_that_just_suffice_are_taken(client, cell):
    assert start(client, poses=7).status_code == 202


def test_infinity_in_a_pose_is_refused(client, cell):
    body = '{"cell":"c1","kind":"calibrate","poses":[{"j1_deg":Infinity}]}'
    answer = client.post("campaigns", content=body, headers={"Content-Type": "application/json"})
    assert answer.status_code == 422


def test_a_verification_without_parameters_is_a_conflict(client, cell):
    answer = start(client, kind="verify")
    assert answer.status_code == 409
    assert "no parameters to verify" in answer.json()["detail"]


def test_the_list_is_newest_first_and_paged(client, cell):
    for _ in range(5):
        start(client)
    first = client.get("campaigns?limit=2").json()
    assert [entry["id"] for entry in first["campaigns"]] == [5, 4]
    second = client.get(f"campaigns?limit=2&before={first['next_before']}").json()
    assert [entry["id"] for entry in second["campaigns"]] == [3, 2]
    last = client.get(f"campaigns?limit=2&before={second['next_before']}").json()
    assert [entry["id"] for entry in last["campaigns"]] == [1]
    assert last["next_before"] is None
    assert client.get("campaigns?cell=other").json()["campaigns"] == []


def test_a_queued_campaign_is_paused_resumed_and_aborted_without_a_worker(client, cell):
    start(client)
    assert client.post("campaigns/1/pause").json() == {"id": 1, "state": "paused"}
    assert client.post("campaigns/1/pause").status_code == 409
    assert client.post("campaigns/1/resume").json() == {"id": 1, "state": "queued"}
    assert client.post("campaigns/1/abort").json() == {"id": 1, "state": "aborted"}
    shown = client.get("campaigns/1").json()
    assert shown["finished"] is not None
    assert shown["reason"] == "aborted by a person"
    assert client.get("cells/c1").json()["armed"] is False
    for action in ("pause", "resume", "abort"):
        answer = client.post(f"campaigns/1/{action}")
        assert answer.status_code == 409
        assert "Campaign 1 is aborted" in answer.json()["detail"]


def test_aborting_a_waiting_campaign_leaves_the_one_that_moves_alone(client, cell, database):
    start(client)
    start(client)
    queue = TableQueue(database, lease_s=60.0)
    moving = queue.claim("w1")
    life = WorkersSide(queue, moving)
    with database.write() as session:
        life.start(session)
    assert client.post("campaigns/2/abort").json() == {"id": 2, "state": "aborted"}
    assert client.get("cells/c1").json()["armed"] is True
    with database.read() as session:
        assert life.wished_stop(session) is None


def test_resuming_needs_an_armed_cell(client, cell):
    start(client, poses=[POSE])
    client.post("campaigns/1/pause")
    client.post("cells/c1/disarm")
    answer = client.post("campaigns/1/resume")
    assert answer.status_code == 409
    assert "not armed" in answer.json()["detail"]


def test_a_skipped_pose_is_no_longer_to_be_done(client, cell):
    start(client, poses=[POSE, POSE], repeats=2)
    client.post("campaigns/1/pause")
    assert client.post("campaigns/1/resume", json={"skip_pose": True}).status_code == 200
    assert client.get("campaigns/1").json()["total"] == 2


def test_what_a_campaign_does_not_have_is_404_with_its_state(client, cell):
    start(client)
    for what in ("identification", "uncertainty", "verification"):
        answer = client.get(f"campaigns/1/{what}")
        assert answer.status_code == 404
        assert what in answer.json()["detail"]
        assert "queued" in answer.json()["detail"]
    for path in ("campaigns/9", "campaigns/9/measurements", "campaigns/9/events"):
        assert client.get(path).status_code == 404


def test_events_go_on_behind_the_later_of_header_and_query(client, cell):
    start(client)
    client.post("campaigns/1/abort")
    last = client.get("campaigns/1").json()["revision"]
    assert f"id: {last}\nevent: progress" in client.get("campaigns/1/events").text
    for header, query, status in ((last, 0, 204), (0, last, 204), (0, last - 1, 200)):
        answer = client.get(
            f"campaigns/1/events?last_event_id={query}", headers={"Last-Event-ID": str(header)}
        )
        assert answer.status_code == status


def test_a_campaign_without_readings_has_the_columns_of_the_contract(client, cell):
    start(client)
    header = client.get("campaigns/1/measurements", headers={"Accept": "text/csv"}).text
    columns = header.strip().split(",")
    assert columns[:2] == ["pose", "repeat"]
    assert {"j1_deg", "j6_deg", "x_mm", "t_s", "approach6", "speed", "settle_s", "cmd6_deg"} <= set(
        columns
    )
    assert client.get("campaigns/1/measurements").json()["rows"] == []
