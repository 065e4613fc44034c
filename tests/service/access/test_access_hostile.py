"""What somebody sends who means no good: it is refused, or kept as the plain text it is."""

import io
import zipfile
from html import unescape
from urllib.parse import quote

import pytest

from service.db.models import CellRow
from service.settings import Settings

HOSTILE = [
    "'; DROP TABLE campaign; --",
    '" OR 1=1 --',
    "../../etc/passwd",
    "..\\..\\secret",
    "{{ 7 * 7 }}",
    "{% include 'base.html' %}",
    "<script>alert(1)</script>",
    "${jndi:ldap://x}",
]
UNSEEN = [
    "a\r\nSet-Cookie: x=1",
    "\u202eevil",
    "\u2066a\u2069",
    "a\x00",
    "a\x9b31m",
]
"""What hides a text, or breaks out of its line."""


@pytest.mark.parametrize("name", HOSTILE + UNSEEN)
def test_a_hostile_name_is_refused_where_names_have_a_form(client, cell, name):
    described = cell | {"name": name}
    for path, body in (
        ("cells", described),
        ("users", {"name": name, "role": "operate"}),
        ("keys", {"name": name, "scope": "read"}),
        ("campaigns", {"cell": name, "kind": "calibrate", "poses": 8}),
    ):
        assert client.post(path, json=body).status_code == 422
    assert client.get("campaigns", params={"cell": name}).json()["campaigns"] == []
    assert client.get("cells").json()["cells"][0]["name"] == "c1"


@pytest.mark.parametrize("text", HOSTILE)
def test_a_hostile_text_is_shown_as_the_text_it_is(client, site, cell, text):
    robot = cell["robot"] | {"address": text}
    assert client.post("cells", json=cell | {"name": "c2", "robot": robot}).status_code == 201
    page = site.get("/parts/cells/c2").text
    assert " ".join(text.split()) in " ".join(unescape(page).split())
    assert "<script>" not in page
    assert "set-cookie" not in site.get("/parts/cells/c2").headers


@pytest.mark.parametrize("text", UNSEEN)
def test_a_text_in_which_something_works_unseen_is_refused(client, nobody, cell, text):
    robot, tracker = cell["robot"] | {"address": text}, cell["tracker"]
    reference = {"certificate": "1", "date": "2026-03-01", "laboratory": text}
    for answer in (
        client.post("cells", json=cell | {"name": "c2", "robot": robot}),
        client.patch("cells/c1", json={"tracker": tracker | {"calibration": reference}}),
        client.post("cells/c1/parameters/1/release", json={"reason": text}),
        client.post("base-transforms/pair/1/rollback", json={"reason": text}),
        client.post("base-calibrations/1/touches/1/void", json={"reason": f"x{text}x"}),
        client.post("webhooks", json={"url": f"http://a/{text}", "events": ["drift.alarm"]}),
        nobody.post("login", json={"name": text, "password": "x"}),
    ):
        assert answer.status_code == 422
        assert "neither control nor direction characters" in answer.json()["detail"]


def test_words_of_any_language_are_texts(client, cell):
    for text in ("减速器已更换", "بعد تغيير ناقل الحركة", "nach Getriebetausch – geprüft", "👩‍🔧"):
        answer = client.post("cells/c1/parameters/1/release", json={"reason": text})
        assert answer.status_code == 404


def test_a_cell_stored_before_its_texts_were_judged_is_still_shown(client, cell, database):
    with database.write() as session:
        session.get_one(CellRow, "c1").document = cell | {
            "robot": cell["robot"] | {"address": "a\u202eb"}
        }
    assert client.get("cells").json()["cells"][0]["robot"]["address"] == "a\u202eb"


@pytest.mark.parametrize("text", HOSTILE + UNSEEN)
def test_a_hostile_address_leads_nowhere(client, text):
    text = quote(text, safe="/")
    for path in (f"cells/{text}", f"cells/{text}/parameters", "cells/%2e%2e%2f%2e%2e%2fetc"):
        answer = client.get(path)
        assert answer.status_code in {404, 405, 422}
        assert "root:" not in answer.text


@pytest.mark.parametrize("text", HOSTILE)
def test_who_logs_in_by_a_hostile_name_is_written_down(client, nobody, text):
    login = {"name": text[:60], "password": "x"}
    assert nobody.post("login", json=login).status_code == 401
    assert text[:20] in "".join(line["who"] for line in client.get("audit").json()["lines"])


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_a_zip_of_an_unusual_method_is_refused_in_one_sentence(client, method):
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", method) as archive:
        archive.writestr("robot.yaml", b"0" * 10_000)
    answer = client.post("campaigns/import", content=target.getvalue())
    assert answer.status_code == 422
    assert "the usual one (deflate)" in answer.json()["detail"]


@pytest.fixture
def settings(database_url: str) -> Settings:
    return Settings(database_url=database_url, json_max_mb=0.1)


def test_a_request_that_is_too_large_is_refused(client, cell):
    body = b'{"name": "' + b"x" * 200_000 + b'"}'
    for path in ("cells", "campaigns", "login"):
        answer = client.post(path, content=body, headers={"Content-Type": "application/json"})
        assert answer.status_code == 413, path
        assert answer.headers["content-type"] == "application/problem+json"
        # The same without saying how much will come.
        pieces = client.post(
            path, content=iter([body]), headers={"Content-Type": "application/json"}
        )
        assert pieces.status_code == 413, path
        assert pieces.headers["content-type"] == "application/problem+json"


def test_every_answer_keeps_browsers_from_doing_more_with_it(client, nobody, site, cell):
    answers = [client.get("cells"), nobody.get("cells"), client.get("nothing"), site.get("/")]
    answers += [client.post("cells", json={}), nobody.get(nobody.base_url.join("/login"))]
    for answer in answers:
        headers = answer.headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["referrer-policy"] in {"no-referrer", "same-origin"}
        assert headers["cache-control"] == "no-store"
        assert "strict-transport-security" not in headers
