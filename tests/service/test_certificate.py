"""The certificate: what it states, and that the same database gives the same bytes."""

import hashlib
import re
import subprocess
import sys

import pytest

from service.clock import utc_now
from service.db.models import CampaignRow, ParametersRow, ResultRow
from service.parameters import life, store
from service.parameters.models import Origin
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.certified_campaign import CELL, FIGURES, identify_again
from tests.service.released_arm import WHY, content_of

VERIFICATION = {
    "before": FIGURES, "after": FIGURES, "passed": True, "reasons": [],
    "criterion": {"pose_accuracy_mean_mm": 0.25, "pose_accuracy_max_mm": 0.5, "poses": 5},
    "iso_9283": {"poses": [{}, {}], "visits": 3, "AP_p_mean_mm": 0.0223, "AP_p_max_mm": 0.0444,
                 "RP_l_mean_mm": 0.031, "RP_l_max_mm": 0.05},
}  # fmt: skip
RENDER = """
import sys
from service.certificate.contents import contents
from service.certificate.document import certificate, certificate_pdf
from service.db.engine import open_database
database = open_database(sys.argv[1])
with database.read() as session:
    made = certificate(contents(session, 1))
    sys.stdout.buffer.write(made.html.encode() + certificate_pdf(made))
database.close()
"""


@pytest.fixture
def certified(client, database):
    """Campaign 1 with its results, version 1 verified by campaign 2."""
    assert client.post("cells", json=CELL).status_code == 201
    client.post("cells/c1/arm")
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 8})
    identify_again(database)
    client.post("campaigns", json={"cell": "c1", "kind": "verify", "poses": 8})
    verification = ResultRow(
        campaign=2, kind="verification", document=VERIFICATION, bundle_sha256="cd" * 32,
        software_version="0.1.0", settings={}, created=utc_now(),
    )  # fmt: skip
    with database.write() as session:
        session.add(verification)
        assert session.get_one(CampaignRow, 2).parameters_version == 1
        life.note_verification(session, session.get_one(ParametersRow, ("c1", 1)), 2, Origin(), [])


def rendered(url: str) -> bytes:
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", RENDER, url], capture_output=True, check=True
    )
    return done.stdout


def test_two_processes_render_the_same_bytes_html_and_pdf(certified, settings):
    first, second = (rendered(settings.database_url) for _ in range(2))
    assert hashlib.sha256(first).hexdigest() == hashlib.sha256(second).hexdigest()
    assert b"%PDF-" in first


def test_it_states_robot_instruments_figures_and_hashes(client, certified):
    answer = client.get("campaigns/1/certificate")
    assert answer.status_code == 200
    assert answer.headers["Content-Type"].startswith("text/html")
    for words in (
        "ur10e, cell c1",
        "version 1, verified",
        "certificate DKD-4711 of 2026-03-01, &lt;PTB&gt; &amp; Co",
        "1.8579",
        "-89.97000",
        # Expanded by two: 2 x 0.0004.
        "0.00080",
        "mean 0.0223 mm, largest 0.0444 mm",
        "mean 0.0310 mm, largest 0.0500 mm",
        "passed",
        "ab" * 32,
    ):
        assert words in answer.text
    assert "Not diagnosed" in answer.text


def test_it_is_a_pdf_by_accept_and_by_query(client, certified):
    for options in ({"headers": {"Accept": "application/pdf"}}, {"params": {"format": "pdf"}}):
        answer = client.get("campaigns/1/certificate", **options)
        assert answer.headers["Content-Type"] == "application/pdf"
        assert answer.content.startswith(b"%PDF-")


def stated(client) -> tuple[str, str, str]:
    """Number, date and state of the parameters, as printed."""
    page = client.get("campaigns/1/certificate").text
    lines = ("Number</th><td>(.*?)<", "Issued</th><td>(.*?)<", "version 1, (.*?)<")
    return tuple(re.search(line, page)[1] for line in lines)


def test_a_certificate_that_states_something_else_has_another_number_and_date(
    client, certified, database
):
    with database.write() as session:
        store.add_candidate(session, "c1", 2, content_of(calibrated_arm("ur10e"), 2))
    seen = [stated(client)]
    for version in (1, 2):
        client.post(f"cells/c1/parameters/{version}/release", json=WHY)
        seen.append(stated(client))
    numbers, dates, states = zip(*seen, strict=True)
    assert list(states) == ["verified", "released", "superseded"]
    assert len(set(numbers)) == 3
    assert list(dates) == sorted(set(dates))
    assert stated(client) == seen[-1]


def test_without_an_identification_there_is_no_certificate(client, certified):
    answer = client.get("campaigns/2/certificate")
    assert answer.status_code == 404
    assert "no identification" in answer.json()["detail"]
