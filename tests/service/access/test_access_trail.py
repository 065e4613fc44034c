"""The audit trail: who did what, written with the deed, never changed."""

import threading

import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from service.db.engine import Database
from tests.credentials import BEARER, PASSWORD


def lines(client) -> list[dict]:
    return client.get("audit").json()["lines"]


def test_a_change_names_who_when_what_and_how_it_ended(client, cell, person, program):
    program("read").post("cells/c1/arm")
    browser = person("anna")
    token = browser.get("me").json()["csrf_token"]
    browser.post("cells/c1/disarm", headers={"X-CSRF-Token": token})
    browser.post("cells/nowhere/arm", headers={"X-CSRF-Token": token})
    found = lines(client)
    told = [(line["who"], line["action"], line["object"], line["status"]) for line in found]
    arm, disarm = "POST /api/v1/cells/{cell}/arm", "POST /api/v1/cells/{cell}/disarm"
    assert told[:2] == [
        ("person anna", arm, "/api/v1/cells/nowhere/arm", 404),
        ("person anna", disarm, "/api/v1/cells/c1/disarm", 200),
    ]
    assert ("key program-read", arm, "/api/v1/cells/c1/arm", 403) in told
    assert ("key bootstrap", arm, "/api/v1/cells/c1/arm", 200) in told
    assert {line["address"] for line in found} == {"127.0.0.1"}
    assert [line["at"] for line in found] == sorted((line["at"] for line in found), reverse=True)


def test_a_deed_and_its_line_are_one_transaction(client, cell, opened, database: Database):
    """Where the trail cannot be written, nothing is done."""
    with database.write() as session:
        session.execute(
            text(
                "CREATE TRIGGER no_more BEFORE INSERT ON audit "
                "BEGIN SELECT RAISE(ABORT, 'no more'); END"
            )
        )
    assert client.post("cells/c1/disarm").status_code >= 500
    assert opened(**BEARER).get("cells/c1").json()["armed"] is True


def test_reading_and_the_unknown_leave_no_line(client, cell, nobody):
    before = lines(client)
    client.get("cells")
    client.post("cells/c1/compensate", json={"poses": []})
    nobody.post("cells/c1/arm")
    nobody.get("cells")
    assert lines(client) == before


def test_logins_are_told_wrong_ones_with_the_name_that_was_tried(client, person, nobody):
    person("anna")
    nobody.post("login", json={"name": "anna", "password": "wrong"})
    nobody.post("login", json={"name": "anna", "password": PASSWORD})
    good, bad = lines(client)[:2]
    assert (good["who"], good["status"]) == ("person anna", 200)
    assert (bad["who"], bad["status"]) == ("nobody as anna", 401)


@pytest.mark.parametrize("change", ["UPDATE audit SET who = 'x'", "DELETE FROM audit"])
def test_the_database_refuses_to_change_the_trail(client, cell, database: Database, change):
    before = lines(client)
    with pytest.raises(DBAPIError, match="never changed"), database.write() as session:
        session.execute(text(change))
    assert lines(client) == before


def test_the_trail_is_read_a_page_at_a_time(client, cell):
    for _ in range(6):
        client.post("cells/c1/disarm")
    seen, before = [], None
    while True:
        query = {"limit": 3} | ({} if before is None else {"before": before})
        page = client.get("audit", params=query).json()
        seen += page["lines"]
        before = page["next_before"]
        if before is None:
            break
    assert seen == lines(client)
    assert len(seen) >= 8


def test_many_at_once_lose_no_line(client, cell):
    def disarm() -> None:
        assert client.post("cells/c1/disarm").status_code == 200

    threads = [threading.Thread(target=disarm) for _ in range(16)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len([line for line in lines(client) if line["object"].endswith("disarm")]) == 16


def test_a_repeated_request_is_told_again_but_done_once(client, cell):
    headers = {"Idempotency-Key": "once"}
    body = {"cell": "c1", "kind": "calibrate", "poses": 8}
    for _ in range(2):
        client.post("campaigns", json=body, headers=headers)
    told = [line for line in lines(client) if line["object"] == "/api/v1/campaigns"]
    assert [line["status"] for line in told] == [202, 202]
    assert len(client.get("campaigns").json()["campaigns"]) == 1
