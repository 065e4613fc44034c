"""What the robot holds is stated once: a campaign that follows or checks another holds the same."""

import pytest

from service.db.models import CampaignRow
from tests.service.certified_campaign import CELL, identify_again


@pytest.mark.parametrize(("stated", "held"), [({}, 4.0), ({"payload_kg": 0.0}, 0.0)])
def test_a_verification_holds_what_its_calibration_held(client, database, stated, held):
    assert client.post("cells", json=CELL).status_code == 201
    client.post("cells/c1/arm")
    wanted = {"cell": "c1", "kind": "calibrate", "poses": 8, "payload_kg": 4.0}
    assert client.post("campaigns", json=wanted).status_code == 202
    identify_again(database)
    wanted = {"cell": "c1", "kind": "verify", "poses": 8, **stated}
    assert client.post("campaigns", json=wanted).status_code == 202
    with database.read() as session:
        assert session.get_one(CampaignRow, 2).payload_kg == held
    assert client.get("campaigns/2").json()["payload_kg"] == held


def test_a_calibration_holds_what_it_states(client, database):
    assert client.post("cells", json=CELL).status_code == 201
    client.post("cells/c1/arm")
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    with database.read() as session:
        assert session.get_one(CampaignRow, 1).payload_kg is None


def test_a_follow_up_cannot_be_compared_with_a_campaign_that_states_no_payload(client, database):
    assert client.post("cells", json=CELL).status_code == 201
    client.post("cells/c1/arm")
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    identify_again(database)
    wanted = {"cell": "c1", "kind": "follow_up", "follows": 1, "payload_kg": 5.0}
    answer = client.post("campaigns", json=wanted)
    assert answer.status_code == 422
    assert "campaign 1 does not state what the arm held" in answer.json()["detail"]
