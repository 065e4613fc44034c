"""The page of a campaign says which poses were left out, and why."""

from service.campaigns import life
from service.db.models import PoseRow


def test_a_left_out_pose_stands_on_the_page_with_its_reason(client, cell, database):
    pose = {f"j{joint}_deg": 10.0 * joint for joint in range(1, 7)}
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": [pose, pose]})
    part = str(client.base_url).replace("/api/v1", "") + "parts/campaigns/1/skipped"
    assert "Poses left out" not in client.get(part).text
    with database.write() as session:
        row = session.get_one(PoseRow, (1, 1))
        row.state, row.reason = "skipped", "not driven: <floor>"
        life.advance(life.find(session, 1))
    text = client.get(part).text
    assert "Poses left out: 1" in text
    assert "not driven: &lt;floor&gt;" in text
    assert client.get("campaigns/1").json()["skipped"] == 1
    found = client.get("campaigns/1/poses?state=skipped").json()["poses"]
    assert [(entry["pose"], entry["reason"]) for entry in found] == [(1, "not driven: <floor>")]
    assert found[0]["joints"]["j2_deg"] == 20.0
