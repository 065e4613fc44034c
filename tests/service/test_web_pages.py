"""The pages as a browser gets them: what they offer, and what they must not let through."""

import re
from collections.abc import Iterator
from html.parser import HTMLParser

import httpx
import pytest

from drivers.registry import ROBOTS as ROBOT_DRIVERS
from drivers.registry import TRACKERS as TRACKER_DRIVERS
from robocal.robots.library import ROBOTS
from service.web import forms
from service.web.words import LANGUAGES

BROWSER = {"Accept": "text/html,application/xhtml+xml,application/xml;q=0.9,*/*;q=0.8"}
VOID = {"input", "meta", "link", "img", "br"}


class Elements(HTMLParser):
    """Every element with its attributes and the text inside it."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict, list[str]]] = []
        self._open: list[tuple[str, dict, list[str]]] = []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        element = (tag, dict(attrs), [])
        self.found.append(element)
        if tag not in VOID:
            self._open.append(element)

    def handle_endtag(self, tag):
        while self._open and self._open.pop()[0] != tag:
            pass

    def handle_data(self, text):
        for _, _, texts in self._open:
            texts.append(text)

    def all(self, *tags: str) -> Iterator[dict]:
        return (attributes for tag, attributes, _ in self.found if tag in tags)

    def text(self, **wanted: str) -> str:
        for _, attributes, texts in self.found:
            if wanted.items() <= attributes.items():
                return " ".join("".join(texts).split())
        raise AssertionError(f"no element with {wanted}")


def queued_campaign(client: httpx.Client, cell: dict) -> int:
    body = {"cell": cell["name"], "kind": "calibrate", "poses": 40}
    return client.post("campaigns", json=body).json()["id"]


def test_the_first_page_offers_every_robot_and_every_driver(site):
    page = Elements(site.get("/").text)
    offered = {attributes.get("value") for attributes in page.all("option")}
    assert {*ROBOTS, *ROBOT_DRIVERS, *TRACKER_DRIVERS, "calibrate", "verify"} <= offered


def test_the_forms_start_with_what_the_service_would_assume(site, client, cell):
    shown = {a.get("name"): a.get("value") for a in Elements(site.get("/").text).all("input")}
    assumed = client.get("cells/c1").json()
    for part in ("tracker", "limits"):
        for name, value in assumed[part].items():
            if isinstance(value, float):
                assert float(shown[f"{part}.{name}"]) == value
    campaign = client.get(f"campaigns/{queued_campaign(client, cell)}").json()
    assert float(shown["settle_s"]) == campaign["settle_s"]
    assert float(shown["repeats"]) == campaign["repeats"]


def test_a_cell_names_its_instrument_in_the_language_of_the_page(site, client, cell):
    shown = site.get("/parts/cells", headers={"Accept-Language": "zh"}).text
    assert "激光跟踪仪" in shown
    assert "laser tracker" not in shown
    assert "laser tracker" in site.get("/parts/cells").text


def test_only_floor_and_payload_may_be_left_empty():
    fields = (*forms.cell_fields(), *forms.cell_detail_fields(), *forms.campaign_fields([]))
    assert [field.path for field in fields if field.nullable] == [
        "limits.floor_mm",
        "payload_kg",
    ]


def test_every_input_has_a_label_and_every_hint_an_owner(site, cell):
    page = Elements(site.get("/").text)
    labelled = {attributes.get("for") for attributes in page.all("label")}
    known = {attributes["id"] for _, attributes, _ in page.found if "id" in attributes}
    inputs = list(page.all("input", "select"))
    assert len(inputs) > 15
    for attributes in inputs:
        named = attributes.get("id") in labelled or "aria-label" in attributes
        assert named or attributes.get("type") in {"hidden", "button"}, attributes
        if "aria-describedby" in attributes:
            assert set(attributes["aria-describedby"].split()) <= known


def test_no_two_elements_of_a_page_share_an_id(site, client, cell):
    number = queued_campaign(client, cell)
    for path in ("/", f"/campaigns/{number}"):
        page = Elements(site.get(path).text)
        ids = [attributes["id"] for _, attributes, _ in page.found if "id" in attributes]
        assert sorted(ids) == sorted(set(ids))


def test_pages_allow_no_inline_and_no_foreign_code(site, client, cell):
    number = queued_campaign(client, cell)
    for path in ("/", f"/campaigns/{number}", "/campaigns/999", "/parts/cells"):
        answer = site.get(path, headers=BROWSER)
        policy = answer.headers["content-security-policy"]
        assert "default-src 'none'" in policy
        assert "script-src 'self';" in policy
        assert "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"
        page = Elements(answer.text)
        for tag, attributes, _ in page.found:
            assert "style" not in attributes
            assert not [name for name in attributes if name.startswith("on")]
            assert tag != "style"
            for name in ("src", "href"):
                assert attributes.get(name, "/").startswith(("/", "#"))
            if tag == "script":
                assert "src" in attributes or attributes["type"] == "application/json"


def test_what_a_person_typed_is_never_taken_for_markup(site, client, cell):
    body = cell | {"name": "c2", "robot": cell["robot"] | {"address": "<b onclick='x()'>&amp;"}}
    assert client.post("cells", json=body).status_code == 201
    for path in ("/", "/parts/cells", "/parts/cells/c2"):
        page = site.get(path).text
        assert "<b " not in page
        assert "&lt;b onclick=&#39;x()&#39;&gt;&amp;amp;" in page


def test_a_cell_shows_whether_it_may_move(site, client, cell):
    assert "may move" in site.get("/parts/cells/c1").text
    assert 'data-do="disarm"' in site.get("/parts/cells/c1").text
    client.post("cells/c1/disarm")
    assert "nothing may move" in site.get("/parts/cells/c1").text
    assert 'data-do="arm"' in site.get("/parts/cells/c1").text


def test_the_list_of_campaigns_leads_to_each(site, client, cell):
    number = queued_campaign(client, cell)
    part = Elements(site.get("/parts/campaigns").text)
    assert f"/campaigns/{number}" in {attributes["href"] for attributes in part.all("a")}
    assert part.text(**{"class": "badge queued"}) == "Queued"


def test_older_campaigns_are_pages_of_their_own(site, client, cell):
    numbers = [queued_campaign(client, cell) for _ in range(45)]
    address, seen = "/", []
    while address:
        page = Elements(site.get(address).text)
        links = [attributes for attributes in page.all("a") if attributes.get("id")]
        seen += [a["href"] for a in links if a["href"].startswith("/campaigns/")]
        older = [a["href"] for a in links if a["id"] == "older-campaigns"]
        address = older[0] if older else ""
    assert seen == [f"/campaigns/{number}" for number in reversed(numbers)]


def test_a_refusal_tells_an_operator_what_to_do_and_not_a_programmer(client, cell):
    client.post("cells/c1/disarm")
    body = {"cell": "c1", "kind": "calibrate", "poses": 40}
    refusals = [
        client.post("campaigns", json=body),
        client.get("campaigns/999"),
        client.post("cells/nowhere/arm"),
    ]
    assert [answer.status_code for answer in refusals] == [409, 404, 404]
    assert "arm the cell first" in refusals[0].json()["detail"]
    for answer in refusals:
        assert "/api/" not in answer.json()["detail"]


def test_a_campaign_page_shows_state_and_readings(site, client, cell):
    page = Elements(site.get(f"/campaigns/{queued_campaign(client, cell)}").text)
    assert page.text(id="state") == "Queued"
    assert next(page.all("progress"))["max"] == "40"
    actions = {
        attributes["data-do"] for attributes in page.all("button") if "data-do" in attributes
    }
    assert {"pause", "resume", "skip", "abort"} <= actions


@pytest.mark.parametrize(
    ("path", "status", "sentence"),
    [
        ("/nosuch", 404, "GET /nosuch: there is no such address."),
        ("/campaigns/999", 404, "There is no campaign 999"),
        ("/base-calibrations/999", 404, "There is no base calibration 999"),
        ("/cells/nowhere", 404, "There is no cell named"),
        ("/campaigns/abc", 422, "path number: "),
        ("/campaigns?before=abc", 422, "query before: "),
    ],
)
def test_a_problem_is_told_to_a_person_on_a_page_and_to_a_program_as_json(
    site, path, status, sentence
):
    seen = site.get(path, headers=BROWSER | {"Accept-Language": "zh"})
    assert seen.status_code == status
    assert seen.headers["content-type"].startswith("text/html")
    assert int(seen.headers["content-length"]) == len(seen.content)
    assert "script-src 'self'" in seen.headers["content-security-policy"]
    assert LANGUAGES["zh"]["problem_title"] in seen.text
    assert sentence in seen.text
    told = site.get(path)
    assert told.status_code == status
    assert told.headers["content-type"] == "application/problem+json"
    assert sentence in told.json()["detail"]


def test_what_only_programs_ask_for_stays_json_in_a_browser(site):
    for path in ("/api/v1/campaigns/999", "/parts/campaigns/999/result"):
        answer = site.get(path, headers=BROWSER)
        assert answer.status_code == 404
        assert answer.headers["content-type"] == "application/problem+json"


def test_without_a_result_the_page_says_why(site, client, cell):
    number = queued_campaign(client, cell)
    address = f"/parts/campaigns/{number}/result"
    assert "The result appears here" in site.get(address).text
    client.post(f"campaigns/{number}/abort")
    assert "ended without a result" in site.get(address).text


def test_the_pages_are_no_part_of_the_documented_interface(client):
    paths = client.get(client.base_url.join("/openapi.json")).json()["paths"]
    assert [
        path for path in paths if not re.match(r"/api/v1/|/(healthz|readyz|metrics)$", path)
    ] == []
