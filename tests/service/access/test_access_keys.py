"""Keys of programs: shown once, stored as hashes, revoked for good."""

import pytest
from sqlalchemy import text

from service.access import keys, known_keys
from service.db.engine import Database
from tests.credentials import KEY


def test_a_key_is_shown_once_and_stored_nowhere(client, opened, database: Database):
    headers = {"Idempotency-Key": "make-mes"}
    first = client.post("keys", json={"name": "mes", "scope": "read"}, headers=headers)
    again = client.post("keys", json={"name": "mes", "scope": "read"}, headers=headers)
    made = first.json()
    assert again.json() == made | {"key": None}
    assert made["key"].startswith(made["prefix"])
    assert len(made["key"]) >= 43
    assert opened(Authorization=f"Bearer {made['key']}").get("me").json()["name"] == "mes"
    listed = client.get("keys").text
    assert made["key"] not in listed
    with database.read() as session:
        tables = ("api_key", "answer", "audit")
        stored = str([session.execute(text(f"SELECT * FROM {table}")).all() for table in tables])
    assert made["key"] not in stored
    assert KEY not in stored


def test_no_two_keys_are_alike(client):
    made = [
        client.post("keys", json={"name": f"k{n}", "scope": "read"}).json()["key"]
        for n in range(20)
    ]
    assert len(set(made)) == 20


def test_a_revoked_key_is_refused_at_once_and_its_name_is_free(client, program):
    known = program("operate")
    assert known.get("cells").status_code == 200
    number = client.get("keys").json()["keys"][0]["id"]
    assert client.post(f"keys/{number}/revoke").json()["revoked"]
    assert known.get("cells").status_code == 401
    again = client.post("keys", json={"name": "program-operate", "scope": "read"})
    assert again.status_code == 201
    assert client.post("keys/999/revoke").status_code == 404


def test_a_key_revoked_elsewhere_changes_nothing_more_and_soon_reads_nothing(
    client, program, database, monkeypatch
):
    known = program("operate")
    assert known.get("cells").status_code == 200
    with database.write() as session:
        keys.revoke(session, client.get("keys").json()["keys"][0]["id"])
    assert known.post("cells/c1/arm").status_code == 401
    monkeypatch.setattr(known_keys, "FRESH_S", 0.0)
    assert known.get("cells").status_code == 401


@pytest.mark.parametrize("name", ["mes", "bootstrap"])
def test_two_valid_keys_never_share_a_name(client, name):
    client.post("keys", json={"name": "mes", "scope": "read"})
    assert client.post("keys", json={"name": name, "scope": "read"}).status_code == 409


@pytest.mark.parametrize(
    "authorization", ["Bearer", "Basic YTpi", KEY, f"Bearer {KEY}x", "Bearer é"]
)
def test_what_is_no_key_is_refused_in_one_sentence(opened, authorization):
    answer = opened().get("cells", headers={"Authorization": authorization.encode()})
    assert answer.status_code == 401
    assert answer.json()["detail"].startswith("Authorization: ")


def test_the_key_of_the_settings_follows_them(database: Database):
    def valid(key: str) -> bool:
        with database.read() as session:
            return keys.verified(session, key) is not None

    for setting in ("first" * 10, "second" * 10, None, "first" * 10):
        with database.write() as session:
            keys.set_bootstrap(session, setting)
        assert valid("first" * 10) is (setting == "first" * 10)
        assert valid("second" * 10) is (setting == "second" * 10)


def test_the_last_use_of_a_key_is_kept(database: Database, client):
    from service.access.last_used import LastUsed

    with database.read() as session:
        number = session.scalar(text("SELECT id FROM api_key"))
    with LastUsed(database) as last_used:
        last_used.note(number)
    (shown,) = client.get("keys").json()["keys"]
    assert shown["last_used"] >= shown["created"]
