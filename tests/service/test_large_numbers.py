"""Numbers that no integer of the database holds: refused, never a failure inside the service."""

BEYOND = (2**31, 2**63, 99999999999999999999, 10**400, -(2**63) - 1)
READS = (
    "campaigns/{}",
    "campaigns/{}/measurements",
    "campaigns/{}/bundle",
    "campaigns/{}/events",
    "campaigns/{}/identification",
    "campaigns/{}/uncertainty",
    "campaigns/{}/verification",
    "campaigns?before={}",
    "cells/c1/parameters?version={}",
    "../../campaigns/{}",
    "../../campaigns?before={}",
    "../../parts/campaigns/{}/result",
)
ACTS = (
    "campaigns/{}/pause",
    "campaigns/{}/resume",
    "campaigns/{}/abort",
    "cells/c1/parameters/{}/release",
)


def test_a_number_beyond_the_database_is_refused(client):
    for number in BEYOND:
        for path in READS:
            assert client.get(path.format(number)).status_code == 422, path
        for path in ACTS:
            assert client.post(path.format(number)).status_code == 422, path


def test_an_event_beyond_the_database_is_refused(client, cell):
    body = {"cell": "c1", "kind": "calibrate", "poses": 40}
    assert client.post("campaigns", json=body).status_code == 202
    for number in BEYOND:
        answer = client.get("campaigns/1/events", headers={"Last-Event-ID": str(number)})
        assert answer.status_code == 422


def test_the_largest_number_is_looked_for(client, cell):
    largest = 2**31 - 1
    assert client.get(f"campaigns/{largest}").status_code == 404
    assert client.get(f"campaigns?before={largest}").json()["campaigns"] == []
    assert client.get(f"cells/c1/parameters?version={largest}").status_code == 404
    assert client.post(f"cells/c1/parameters/{largest}/release").status_code == 404
