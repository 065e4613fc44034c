import pytest

from service.parameters import store
from service.parameters.models import ParametersContent, Provenance
from tests.service.released_arm import WHY

CONTENT = ParametersContent(
    parameters=[{"name": "d_1", "unit": "mm", "nominal": 180.7, "identified": 180.9, "std": 0.004}],
    base={"xyz_mm": [1, 2, 3], "ypr_deg": [0, 0, 0], "std": [0] * 6},
    tool={},
    residuals={"before": {"position_rms_mm": 1.4}},
    uncertainty={"draws": 10000},
    model={"format": "robocal-model-1"},
    provenance=Provenance(
        campaign=1, bundle_sha256="ab", software_version="0.1.0", computed="2026-11-22"
    ),
)


@pytest.fixture
def candidates(client, cell, database):
    """Two candidates of cell c1."""
    body = {"cell": "c1", "kind": "calibrate", "poses": 8}
    client.post("campaigns", json=body)
    for _ in range(2):
        with database.write() as session:
            store.add_candidate(session, "c1", 1, CONTENT)


def test_without_any_parameters_the_answer_says_how_to_get_them(client, cell):
    answer = client.get("cells/c1/parameters")
    assert answer.status_code == 404
    assert "a finished calibration makes a candidate" in answer.json()["detail"]


def test_without_released_ones_the_answer_names_the_candidate(client, candidates):
    answer = client.get("cells/c1/parameters")
    assert answer.status_code == 404
    assert "version 2 is a candidate" in answer.json()["detail"]
    assert "parameters/2/release" in answer.json()["detail"]


def test_the_released_version_is_what_the_mes_reads(client, candidates):
    released = client.post("cells/c1/parameters/1/release", json=WHY).json()
    assert (released["version"], released["state"]) == (1, "released")
    shown = client.get("cells/c1/parameters")
    assert shown.json() == released
    assert shown.json()["parameters"] == CONTENT.parameters
    assert shown.json()["provenance"]["bundle_sha256"] == "ab"
    assert client.get("cells/c1/parameters?state=candidate").json()["version"] == 2


def test_a_release_supersedes_the_one_before(client, candidates):
    client.post("cells/c1/parameters/1/release", json=WHY)
    client.post("cells/c1/parameters/2/release", json=WHY)
    states = [
        client.get(f"cells/c1/parameters?version={number}").json()["state"] for number in (1, 2)
    ]
    assert states == ["superseded", "released"]
    again = client.post("cells/c1/parameters/1/release", json=WHY)
    assert again.status_code == 409
    assert "superseded" in again.json()["detail"]


def test_an_unchanged_version_is_answered_with_304(client, candidates):
    client.post("cells/c1/parameters/1/release", json=WHY)
    first = client.get("cells/c1/parameters")
    etag = first.headers["ETag"]
    for known in (etag, f"W/{etag}", f'"other", {etag}', "*"):
        again = client.get("cells/c1/parameters", headers={"If-None-Match": known})
        assert again.status_code == 304
        assert again.content == b""
        assert again.headers["ETag"] == etag
    client.post("cells/c1/parameters/2/release", json=WHY)
    changed = client.get("cells/c1/parameters", headers={"If-None-Match": etag})
    assert changed.status_code == 200
    assert changed.headers["ETag"] != etag


def test_a_version_that_is_not_there_and_a_double_question_are_refused(client, candidates):
    assert client.get("cells/c1/parameters?version=9").status_code == 404
    assert client.post("cells/c1/parameters/9/release", json=WHY).status_code == 404
    assert client.get("cells/c1/parameters?version=1&state=candidate").status_code == 422
    assert client.get("cells/c1/parameters?state=secret").status_code == 422
