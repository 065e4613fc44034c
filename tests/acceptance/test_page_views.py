"""Plan, live view, languages, colours and the life of parameters in a real browser."""

import copy
import re
from collections.abc import Iterator
from contextlib import closing, contextmanager

import numpy as np
import pytest
from playwright.sync_api import Page, expect
from sqlalchemy.orm import Session

from service.db.engine import open_database
from service.db.models import CampaignRow, ResultRow
from service.health_checks.models import HealthPoint
from service.parameters import store
from service.web.words import LANGUAGES
from tests.acceptance.test_page import (
    PATIENCE_MS,
    Watched,
    keep_picture,
    plotted,
    watched,
)
from tests.integration.service_cell import Site, emulated_world, installation
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import content_of
from tests.service.test_web_results import IDENTIFICATION


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Iterator[Site]:
    with installation(tmp_path_factory.mktemp("views")) as running:
        yield running


def ground(page: Page) -> str:
    return page.evaluate("getComputedStyle(document.body).backgroundColor")


def test_language_and_colours_are_kept_by_the_browser(browser, place):
    with watched(browser, place) as seen:
        page = seen.page
        seen.open()
        light = ground(page)
        page.get_by_label("Language").select_option("zh")
        expect(page.locator("html")).to_have_attribute("lang", "zh")
        expect(page.locator("#new-campaign-title")).to_have_text(LANGUAGES["zh"]["new_campaign"])
        page.locator("#theme").select_option("dark")
        assert ground(page) != light
        page.reload()
        expect(page.locator("html")).to_have_attribute("lang", "zh")
        expect(page.locator("html")).to_have_attribute("data-theme", "dark")
        assert ground(page) != light
        page.set_viewport_size({"width": 768, "height": 1024})
        assert page.evaluate("document.documentElement.scrollWidth") <= 768
        seen.require_clean()


def test_the_previewed_plan_is_driven_while_two_people_watch_and_one_ends_it(
    browser, place, tmp_path
):
    with emulated_world(tmp_path, time_scale=5) as world, watched(browser, place) as anna:
        page = anna.page
        anna.open()
        anna.create_cell("seen", world.address)
        form = page.locator("#new-campaign")
        form.get_by_label("Kind").select_option("calibrate")
        form.get_by_label("Poses").fill("3")
        expect(page.locator("#campaign-poses-note")).to_contain_text("Too few", timeout=PATIENCE_MS)
        form.get_by_label("Poses").fill("12")
        page.locator("#plan[data-poses='12']").wait_for()
        _turns_by_key(page, "#plan-space canvas")
        keep_picture(page, "plan.png")
        seed = int(form.locator("[name=seed]").input_value())
        address = f"/parts/cells/seen/plan?poses=12&seed={seed}"
        plan = page.evaluate("path => fetch(path).then(answer => answer.json())", address)
        anna.arm("seen")
        number = anna.start_campaign("seen", "calibrate", 12)
        with browser.new_context() as context:
            context.add_cookies([place.login_cookie("otto", "operate")])
            otto = Watched(context.new_page(), place)
            otto.open(f"/campaigns/{number}")
            for one in (page, otto.page):
                one.locator("#live[data-arms]").wait_for()
                one.locator("#live[data-pose]").wait_for()
                expect(one.locator("#live-position .value")).to_have_count(3)
            page.locator("#live-residuals .point").nth(7).wait_for()
            keep_picture(page, "live.png")
            otto.page.get_by_role("button", name="Abort", exact=True).click()
            otto.page.get_by_role("button", name="Abort the campaign").click()
            for one in (anna, otto):
                one.await_state("Aborted")
                one.require_clean()
        row = place.get(f"/campaigns/{number}/measurements").json()["rows"][0]
        driven = [row[f"cmd{joint}_deg"] for joint in range(1, 7)]
        assert np.allclose(driven, plan["joints"][0], atol=0.006)


def _turns_by_key(page: Page, selector: str) -> None:
    canvas = page.locator(selector)
    before = canvas.evaluate("canvas => canvas.toDataURL()")
    canvas.focus()
    page.keyboard.press("ArrowLeft")
    page.wait_for_function(
        "([selector, before]) => document.querySelector(selector).toDataURL() !== before",
        arg=[selector, before],
    )


def ended_campaigns(place: Site, cell: str, count: int) -> list[int]:
    """Campaigns of a cell whose devices are nowhere, marked as finished."""
    device = {"driver": "mock", "address": "127.0.0.1:9"}
    robot = {"model": "ur10e", **device}
    place.post("/cells", {"name": cell, "robot": robot, "tracker": device})
    numbers = []
    for _ in range(count):
        place.post(f"/cells/{cell}/arm")
        numbers.append(place.start_campaign(40, cell))
        place.post(f"/campaigns/{numbers[-1]}/abort")
        place.await_state(numbers[-1], "aborted")
    with kept(place) as session:
        for number in numbers:
            session.get_one(CampaignRow, number).state = "finished"
    return numbers


@contextmanager
def kept(place: Site) -> Iterator[Session]:
    """Write into the place's database past the service."""
    with closing(open_database(place.database_url)) as database, database.write() as session:
        yield session


def result(campaign: int, kind: str, document: dict, created: str) -> ResultRow:
    origin = {"bundle_sha256": "ab" * 32, "software_version": "0", "settings": {}}
    return ResultRow(campaign=campaign, kind=kind, document=document, created=created, **origin)


def decide(page: Page, version: int, step: str, reason: str) -> None:
    page.get_by_label("Reason").fill(reason)
    page.locator(f"#versions tr[data-version='{version}']").get_by_role("button", name=step).click()
    page.get_by_role("dialog").get_by_role("button", name=step).click()


def test_an_engineer_releases_a_version_and_takes_it_back(browser, place):
    (number,) = ended_campaigns(place, "life", 1)
    with kept(place) as session:
        for _ in range(2):
            store.add_candidate(
                session, "life", number, content_of(calibrated_arm("ur10e"), number)
            )
    with watched(browser, place) as seen:
        page = seen.page
        seen.open("/cells/life")
        decide(page, 1, "Release", "")
        expect(page.locator("#decision")).to_contain_text("not verified")
        seen.errors.clear()
        state = "#versions tr[data-version='{}'] .badge"
        for version in (1, 2):
            decide(page, version, "Release", "commissioning")
            expect(page.locator(state.format(version))).to_have_text("Released")
        decide(page, 1, "Roll back", "the tool was changed back")
        expect(page.locator(state.format(1))).to_have_text("Released")
        expect(page.locator(state.format(2))).to_have_text("Superseded")
        back = re.compile("person anna.*the tool was changed back", re.DOTALL)
        expect(page.locator("#history")).to_contain_text(back)
        assert place.get("/cells/life/parameters").json()["version"] == 1
        seen.require_clean()


def test_the_trend_of_health_checks_is_charted_against_its_limit(browser, place):
    point = {name: None for name in HealthPoint.model_fields if name not in {"campaign", "at"}}
    point |= {"parameters_version": 1, "degrees_of_freedom": 24, "p_value": 0.5, "z": 0.0}
    point |= {"trend_alarm": False, "full_campaign_needed": False, "position_rms_mm": 0.04}
    ratios = [0.5, 0.75, 2.0]
    numbers = ended_campaigns(place, "trend", 3)
    with kept(place) as session:
        for number, ratio in zip(numbers, ratios, strict=True):
            told = {"alarm": ratio > 1.0, "advice": f"Advice of campaign {number}."}
            square = {"chi_square": 40.0 * ratio, "chi_square_limit": 40.0}
            at = f"2026-0{1 + number % 9}-01T00:00:00+00:00"
            session.add(result(number, "health", point | told | square, at))
    with watched(browser, place) as seen:
        page = seen.page
        seen.open("/cells/trend")
        page.locator("#health-plot[data-drawn]").wait_for()
        assert plotted(page, "#health-plot") == [ratios]
        latest = page.locator("#health-latest.bad")
        expect(latest).to_contain_text(f"Advice of campaign {numbers[-1]}.")
        colours = page.locator("#health-plot").evaluate("plot => plot.data[0].marker.color")
        assert colours[0] == colours[1] != colours[2]
        seen.require_clean()


def test_two_calibrations_are_chosen_and_compared(browser, place):
    numbers = ended_campaigns(place, "compared", 2)
    moved = copy.deepcopy(IDENTIFICATION)
    moved["parameters"][1]["identified"] += 0.1
    with kept(place) as session:
        for number, found in zip(numbers, (IDENTIFICATION, moved), strict=True):
            session.add(result(number, "identification", found, "2026-01-01T00:00:00+00:00"))
    with watched(browser, place) as seen:
        page = seen.page
        seen.open()
        page.get_by_role("link", name="Compare").click()
        for side, number in zip(("first", "second"), numbers, strict=True):
            page.locator(f"#compare-{side}").select_option(str(number))
        page.get_by_role("button", name="Compare").click()
        clear = page.locator("tr.clear")
        expect(clear).to_have_count(1)
        expect(clear).to_contain_text("+0.100")
        seen.require_clean()


def test_two_tabs_of_one_form_do_not_disturb_each_other(browser, place):
    with watched(browser, place) as one:
        other = Watched(one.page.context.new_page(), place)
        for tab, name in ((one, "left"), (other, "right")):
            tab.open()
            tab.describe_cell(name, "127.0.0.1:9")
        one.page.reload()
        form = one.page.locator("#new-cell")
        expect(form.get_by_label("Name", exact=True)).to_have_value("left")
        form.get_by_role("button", name="Create cell").click()
        for tab in (one, other):
            tab.page.locator("[data-cell=left]").wait_for()
        theirs = other.page.locator("#new-cell")
        expect(theirs.get_by_label("Name", exact=True)).to_have_value("right")
        theirs.get_by_label("Name", exact=True).fill("left")
        theirs.get_by_role("button", name="Create cell").click()
        expect(theirs.get_by_role("alert")).to_contain_text("left")
        expect(theirs.get_by_label("Robot address")).to_have_value("127.0.0.1:9")
        expect(other.page.locator("#new-campaign [name=cell] option[value=left]")).to_have_count(1)
        one.require_clean()
