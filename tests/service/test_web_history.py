"""Pages about more than one campaign, against figures worked out on paper."""

import copy

import pytest

from service.db.models import CampaignRow
from service.parameters import store
from service.web import history_router
from service.web.compare_view import compared_errors, compared_parameters
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import WHY, content_of
from tests.service.test_web_pages import Elements
from tests.service.test_web_results import IDENTIFICATION, Cells, parameter, summary


@pytest.fixture
def later() -> dict:
    """A second calibration: a_2 moved by 0.06 mm, alpha_2 by its own uncertainty."""
    found = copy.deepcopy(IDENTIFICATION)
    found["parameters"][1] = parameter("a_2", "mm", -612.7, -612.89, 0.016)
    found["parameters"][2] = parameter("alpha_2", "deg", 90.0, 90.0136, 0.0011)
    found["residuals"]["held_out"] = summary(10, 0.2)
    return found


def test_a_parameter_that_moved_is_told_from_one_that_did_not(later):
    length, angle = compared_parameters(IDENTIFICATION, later)
    # sqrt(0.012^2 + 0.016^2) = 0.02, and 0.06 is three of them.
    assert (length.symbol, length.joint, length.unit) == ("a", "2", "mm")
    assert (length.first, length.second) == ("−612.950", "−612.890")
    assert (length.difference, length.std, length.ratio) == ("+0.060", "0.020", "+3.0")
    # 0.0011 over sqrt(2) times 0.0011.
    assert (angle.ratio, angle.clear) == ("+0.7", False)
    further = copy.deepcopy(later)
    further["parameters"][1]["identified"] = -612.80
    assert compared_parameters(IDENTIFICATION, further)[0].clear


def test_what_one_of_two_did_not_identify_is_not_compared(later):
    later["parameters"][1]["status"] = "redundant"
    assert [line.symbol for line in compared_parameters(IDENTIFICATION, later)] == ["α"]


def test_errors_stand_side_by_side(later):
    errors = {
        line.key: (line.first, line.second) for line in compared_errors(IDENTIFICATION, later)
    }
    assert errors["residuals_held_out"] == ("0.1000", "0.2000")
    assert errors["residuals_before"] == ("0.8000", "0.8000")


def test_a_comparison_without_a_result_says_so_on_a_page(site, client, cell):
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 40})
    answer = site.get("/compare?first=1&second=1", headers={"Accept": "text/html"})
    assert answer.status_code == 404
    assert "has no identification" in answer.text
    assert "It takes two finished calibrations" in site.get("/compare").text


@pytest.fixture
def versions(client, cell, database) -> None:
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 40})
    with database.write() as session:
        for _ in range(2):
            store.add_candidate(session, "c1", 1, content_of(calibrated_arm("ur10e")))


def test_calibrations_can_be_compared_however_many_checks_came_after(site, client, cell, database):
    client.post("campaigns", json={"cell": "c1", "kind": "calibrate", "poses": 40})
    with database.write() as session:
        calibration = session.get_one(CampaignRow, 1)
        calibration.state = "finished"
        columns = [column.key for column in CampaignRow.__table__.columns if column.key != "id"]
        same = {column: getattr(calibration, column) for column in columns}
        session.add_all(
            CampaignRow(**same | {"kind": "health"}) for _ in range(history_router.OFFERED)
        )
    offered = [
        attributes["value"]
        for tag, attributes, _ in Elements(site.get("/compare").text).found
        if tag == "option" and attributes.get("value", "").isdecimal()
    ]
    assert set(offered) == {"1"}


def test_each_version_leads_to_its_own_certificate(site, versions):
    found = Elements(site.get("/cells/c1").text).found
    links = [attributes["href"] for tag, attributes, _ in found if tag == "a"]
    certificates = [link for link in links if "certificate" in link]
    path = "/api/v1/campaigns/1/certificate"
    assert certificates == [f"{path}?version=2", f"{path}?version=1"]


def actions(page: str) -> dict[str, str]:
    """What may be done to each version, by the buttons."""
    found: dict[str, str] = {}
    number = ""
    for tag, attributes, _ in Elements(page).found:
        if tag == "tr":
            number = attributes.get("data-version", "")
        if tag == "button" and number:
            found[number] = attributes["data-do"]
    return found


def test_a_person_sees_what_may_be_done_to_each_version_and_who_did_what(site, client, versions):
    assert actions(site.get("/cells/c1").text) == {"1": "release", "2": "release"}
    for number in (1, 2):
        client.post(f"cells/c1/parameters/{number}/release", json=WHY)
    page = site.get("/cells/c1").text
    assert actions(page) == {"1": "rollback"}
    shown = Cells(page)
    assert "commissioning" in shown.text
    assert [row[1:3] for row in shown.rows if len(row) == 5][1:4] == [
        ["2", "Released"],
        ["1", "Superseded"],
        ["1", "Released"],
    ]


def test_an_operator_sees_the_versions_and_decides_nothing(site, client, versions):
    key = client.post("keys", json={"name": "panel", "scope": "operate"}).json()["key"]
    page = site.get("/cells/c1", headers={"Authorization": f"Bearer {key}"}).text
    assert "Candidate" in page
    assert actions(page) == {}
