"""Each version of a campaign has its own certificate, with its own numbers alone."""

import hashlib
import re

import pytest
import yaml
from sqlalchemy import select

from service.db.models import ResultRow
from tests.service.certified_campaign import CELL, find_effects, identify_again
from tests.service.released_arm import WHY

GEOMETRY = {"-89.97000", "1.8579"}
WITH_EFFECTS = {"-89.91000", "0.0612", "joint compliance, joint 2", "1.25e-06", "2e-07"}
LATER = {"-89.88000", "1.7777"}


@pytest.fixture
def versions(client, database) -> None:
    """Campaign 1 with version 1 of the geometry, 2 with effects and released, 3 computed again."""
    client.post("cells", json=CELL)
    client.post("cells/c1/arm")
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    identify_again(database)
    find_effects(database, theta_2_deg=-89.91, rms_after_mm=0.0612)
    assert client.post("cells/c1/parameters/2/release", json=WHY).status_code == 200
    identify_again(database, theta_2_deg=-89.88, rms_before_mm=1.7777)


def printed(client, **query) -> str:
    answer = client.get("campaigns/1/certificate", params=query)
    assert answer.status_code == 200, answer.text
    return answer.text


def numbers_on(page: str) -> set[str]:
    """What stands there of all that tells the versions apart."""
    model_and_effects = page.partition("<h2>Diagnosis")[0] + page.partition("<h2>Parameters")[2]
    return {words for words in GEOMETRY | WITH_EFFECTS | LATER if words in model_and_effects}


def test_the_numbers_are_those_of_the_version_that_is_named(client, versions):
    page = printed(client)
    assert "version 2, released" in page
    assert numbers_on(page) == WITH_EFFECTS
    assert "numbers identified" not in page


@pytest.mark.parametrize(
    ("version", "state", "numbers"),
    [
        (1, "candidate", GEOMETRY),
        (2, "released", WITH_EFFECTS),
        (3, "candidate", LATER),
    ],
)
def test_any_version_of_the_campaign_can_be_asked_for(client, versions, version, state, numbers):
    page = printed(client, version=version)
    assert f"version {version}, {state}" in page
    assert numbers_on(page) == numbers


def test_the_model_is_hashed_that_the_version_was_stored_with(client, database, versions):
    with database.read() as session:
        written = select(ResultRow.model_yaml).where(ResultRow.model_yaml.is_not(None))
        texts = session.scalars(written.order_by(ResultRow.id)).all()
    hashes = [hashlib.sha256(text.encode()).hexdigest() for text in texts]
    models = [yaml.safe_load(text) for text in texts]
    assert len(set(hashes)) == 3
    for version, expected, model in zip((1, 2, 3), hashes, models, strict=True):
        found = re.search(r"model.yaml</td><td><code>(\w+)", printed(client, version=version))
        assert found[1] == expected
        assert client.get(f"cells/c1/parameters?version={version}").json()["model"] == model


def test_what_a_diagnosis_names_is_not_said_to_be_in_a_model_without_effects(client, versions):
    assert "hold none of the effects" in printed(client, version=1)
    assert "hold none of the effects" not in printed(client, version=2)


def test_a_certificate_does_not_change_when_another_version_is_computed(client, database, versions):
    before = printed(client)
    identify_again(database, theta_2_deg=-89.5)
    assert printed(client) == before


def test_a_version_of_another_campaign_is_not_found(client, versions):
    answer = client.get("campaigns/1/certificate?version=4")
    assert answer.status_code == 404
    assert answer.json()["detail"] == (
        "Version 4 of the parameters is not of campaign 1, whose versions are: 1, 2, 3."
    )
