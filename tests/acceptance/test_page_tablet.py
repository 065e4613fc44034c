"""How the pages stand on an upright tablet beside the cell; their content is made by the tests."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Page

from service.clock import utc_now
from service.health_checks.models import HealthPoint
from service.parameters import store
from tests.acceptance.test_page import Watched, watched
from tests.acceptance.test_page_live import HEALTHY, plan, running_campaign, stand
from tests.acceptance.test_page_views import ended_campaigns, kept, result
from tests.integration.service_cell import START_DEG, Site, installation
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import content_of

LONGEST = [-2.9, -1.5, -2.4, -1.9, -2.2, -2.8]
HOUR_MS = 3_600_000


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Iterator[Site]:
    with installation(tmp_path_factory.mktemp("tablet")) as running:
        yield running


@pytest.fixture
def tablet(browser, place) -> Iterator[Watched]:
    with watched(browser, place) as seen:
        seen.page.set_viewport_size({"width": 820, "height": 1180})
        yield seen
        seen.require_clean()


def test_a_cells_heading_has_air_and_its_buttons_one_line(tablet, place):
    (number,) = ended_campaigns(place, "life", 1)
    with kept(place) as session:
        for _ in range(2):
            content = content_of(calibrated_arm("ur10e"), number)
            store.add_candidate(session, "life", number, content)
    for version in (1, 2):
        reason = {"reason": "commissioning"}
        assert place.post(f"/cells/life/parameters/{version}/release", reason).is_success
    page = tablet.page
    tablet.open("/cells/life")
    heading = page.locator("h1").bounding_box()
    card = page.locator("main section").first.bounding_box()
    assert card["y"] - (heading["y"] + heading["height"]) >= 12
    back = page.get_by_role("button", name="Roll back")
    tops = back.evaluate("""(button) => {
        const range = document.createRange();
        range.selectNodeContents(button);
        return Array.from(range.getClientRects(), (box) => box.top);
    }""")
    assert len(set(tops)) == 1


def test_a_single_health_check_stands_on_an_axis_that_can_be_read(tablet, place):
    (number,) = ended_campaigns(place, "single", 1)
    point = dict.fromkeys(HealthPoint.model_fields.keys() - {"campaign", "at"})
    point |= {"parameters_version": 1, "degrees_of_freedom": 24, "p_value": 0.5, "z": 0.0}
    point |= {"full_campaign_needed": False, **HEALTHY}
    with kept(place) as session:
        session.add(result(number, "health", point, utc_now()))
    page = tablet.page
    tablet.open("/cells/single")
    plot = page.locator("#health-plot[data-drawn]")
    plot.wait_for()
    least, most = plot.evaluate("plot => plot.layout.xaxis.range.map(at => +new Date(at))")
    assert most - least >= HOUR_MS
    checked = plot.evaluate("plot => +new Date(plot.data[0].x[0])")
    assert least < checked < most


def test_a_joints_name_and_reading_stand_on_one_line(tablet, place):
    number = running_campaign(place, "named", "calibrate")
    plan(place, number, range(1), "calibrate")
    stand(place, number, LONGEST)
    page = tablet.page
    tablet.open(f"/campaigns/{number}")
    page.locator("#live[data-arms='1']").wait_for()
    for width in range(770, 890, 10):
        page.set_viewport_size({"width": width, "height": 1180})
        assert lines_of_pairs(page) == [1] * len(START_DEG), width


def lines_of_pairs(page: Page) -> list[int]:
    """On how many lines each joint's name and reading stand."""
    return page.locator("#live-joints").evaluate("""(place) => {
        const text = place.firstChild;
        return Array.from(text.data.matchAll(/j\\d\\s\\S+/g), (pair) => {
            const range = document.createRange();
            range.setStart(text, pair.index);
            range.setEnd(text, pair.index + pair[0].length);
            return new Set(Array.from(range.getClientRects(), (box) => box.top)).size;
        });
    }""")
