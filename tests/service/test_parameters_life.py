"""Who verified, released and rolled back what, and what each step needs."""

import pytest

from service.db.models import ParametersRow
from service.parameters import life, store
from service.parameters.models import Origin
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import WHY, content_of

ORIGIN = Origin(bundle_sha256="cd" * 32, software_version="0", settings={"a": 1}, seed=7)


@pytest.fixture
def versions(client, cell, database):
    """Three candidates of cell c1."""
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    with database.write() as session:
        for _ in range(3):
            store.add_candidate(session, "c1", 1, content_of(calibrated_arm("ur10e")))


def verify(database, number: int, *failures: str) -> None:
    with database.write() as session:
        row = session.get_one(ParametersRow, ("c1", number))
        life.note_verification(session, row, 1, ORIGIN, list(failures))


def state(client, number: int) -> str:
    return client.get(f"cells/c1/parameters?version={number}").json()["state"]


def steps(client, **query) -> list[tuple]:
    found = client.get("cells/c1/parameters/history", params=query).json()["history"]
    return [(step["version"], step["event"]) for step in found]


def test_a_verified_version_is_released_without_a_reason(client, versions, database):
    verify(database, 2)
    assert state(client, 2) == "verified"
    assert client.post("cells/c1/parameters/2/release").status_code == 200
    assert client.get("cells/c1/parameters").json()["version"] == 2


def test_an_unverified_version_takes_a_reason(client, versions):
    refused = client.post("cells/c1/parameters/1/release")
    assert refused.status_code == 409
    assert "not verified" in refused.json()["detail"]
    empty = client.post("cells/c1/parameters/1/release", json={"reason": "  "})
    assert empty.status_code == 409
    assert client.post("cells/c1/parameters/1/release", json=WHY).status_code == 200


def test_a_failed_verification_takes_the_verified_state_away(client, versions, database):
    verify(database, 1)
    verify(database, 1, "The mean is too large.")
    assert state(client, 1) == "candidate"
    last = client.get("cells/c1/parameters/history?limit=1").json()["history"][0]
    assert (last["event"], last["reason"]) == ("verification_failed", "The mean is too large.")


def test_a_released_version_stays_released_whatever_a_verification_says(client, versions, database):
    client.post("cells/c1/parameters/1/release", json=WHY)
    verify(database, 1, "The mean is too large.")
    assert state(client, 1) == "released"
    assert steps(client)[0] == (1, "verification_failed")


def test_a_rollback_brings_an_earlier_released_version_back(client, versions):
    for number in (1, 2):
        client.post(f"cells/c1/parameters/{number}/release", json=WHY)
    body = {"reason": "version 2 was measured with a loose nest"}
    back = client.post("cells/c1/parameters/1/rollback", json=body)
    assert (back.status_code, back.json()["state"]) == (200, "released")
    assert client.get("cells/c1/parameters").json()["version"] == 1
    assert state(client, 2) == "superseded"
    assert steps(client, limit=2) == [(1, "rolled_back"), (2, "superseded")]
    for number in (1, 3):
        refused = client.post(f"cells/c1/parameters/{number}/rollback")
        assert refused.status_code == 409
        assert "superseded" in refused.json()["detail"]


def test_the_history_says_who_when_and_from_which_readings(client, versions, database):
    verify(database, 1)
    client.post("cells/c1/parameters/1/release", json={"reason": "as planned"})
    released, verified, *_, computed = client.get(
        "cells/c1/parameters/history", params={"version": 1}
    ).json()["history"]
    assert released["person"]
    assert released["reason"] == "as planned"
    assert released["at"] >= verified["at"] >= computed["at"]
    assert verified["person"] is None
    assert verified["origin"] == ORIGIN.model_dump()
    assert computed["origin"]["bundle_sha256"] == "ab" * 32


def test_history_and_versions_are_paged_to_their_end(client, versions):
    seen, before = [], None
    while True:
        page = client.get(
            "cells/c1/parameters/history",
            params={"limit": 2} | ({"before": before} if before else {}),
        ).json()
        seen += [step["version"] for step in page["history"]]
        before = page["next_before"]
        if before is None:
            break
    assert seen == [3, 2, 1]
    first = client.get("cells/c1/parameters/versions?limit=2").json()
    assert [row["version"] for row in first["versions"]] == [3, 2]
    rest = client.get(f"cells/c1/parameters/versions?before={first['next_before']}").json()
    assert [row["version"] for row in rest["versions"]] == [1]
    assert client.get("cells/c1/parameters/versions?state=released").json()["versions"] == []


def test_the_history_cannot_be_changed_in_the_database(versions, database):
    for change in ("UPDATE parameters_event SET person = 'x'", "DELETE FROM parameters_event"):
        with pytest.raises(Exception, match="never changed"), database.write() as session:
            session.connection().exec_driver_sql(change)
