"""Lists: a page at a time, and only what was asked for."""

import json

import pytest

from service.main import openapi_text


@pytest.fixture
def campaigns(client, cell):
    """Three campaigns in two cells; the first is aborted."""
    client.post("cells", json=cell | {"name": "c2"})
    client.post("cells/c2/arm")
    for name in ("c1", "c2", "c2"):
        body = {"cell": name, "kind": "calibrate", "poses": 8}
        assert client.post("campaigns", json=body).status_code == 202
    client.post("campaigns/1/abort")


def numbers(client, **query) -> list[int]:
    answer = client.get("campaigns", params=query)
    assert answer.status_code == 200, answer.text
    return [entry["id"] for entry in answer.json()["campaigns"]]


def test_campaigns_are_filtered_by_cell_kind_state_and_time(client, campaigns):
    assert numbers(client) == [3, 2, 1]
    assert numbers(client, cell="c2") == [3, 2]
    assert numbers(client, state="aborted") == [1]
    assert numbers(client, state="queued", cell="c1") == []
    assert numbers(client, kind="verify") == []
    made = client.get("campaigns/2").json()["created"]
    assert numbers(client, since=made) == [3, 2]
    assert numbers(client, since="2200-01-01T00:00:00Z") == []
    assert numbers(client, since="1990-01-01T00:00:00+14:00") == [3, 2, 1]
    assert numbers(client, since="1990-01-01T00:00:00", limit=1) == [3]


@pytest.mark.parametrize(
    "query", ["state=gone", "kind=dance", "since=yesterday", "since=0001-01-01T00:00:00+14:00"]
)
def test_a_filter_that_means_nothing_is_refused(client, campaigns, query):
    answer = client.get(f"campaigns?{query}")
    assert answer.status_code == 422
    assert query.partition("=")[0] in answer.json()["detail"]


def test_cells_are_paged_by_name(client, campaigns):
    first = client.get("cells?limit=1").json()
    assert [cell["name"] for cell in first["cells"]] == ["c1"]
    rest = client.get("cells", params={"after": first["next_after"]}).json()
    assert [cell["name"] for cell in rest["cells"]] == ["c2"]
    assert rest["next_after"] is None


# Their answers make or end a login, which must not be kept to be given again.
OF_LOGINS = {"/api/v1/login", "/api/v1/logout", "/api/v1/password", "/api/v1/welcome"}


def test_every_post_takes_an_idempotency_key():
    paths = json.loads(openapi_text())["paths"]
    without = [
        path
        for path, calls in paths.items()
        if path.startswith("/api/") and "post" in calls
        if not any(
            parameter["name"].lower() == "idempotency-key"
            for parameter in calls["post"].get("parameters", [])
        )
    ]
    assert set(without) == OF_LOGINS
