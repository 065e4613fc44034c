"""Plan, live view, languages, colours and the life of parameters in a real browser."""

import re
from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from service.db.engine import open_database
from service.parameters import store
from service.web.words import LANGUAGES
from tests.acceptance.test_page import (
    ARGUMENTS,
    CHROMIUM,
    PATIENCE_MS,
    Watched,
    keep_picture,
    watched,
)
from tests.integration.service_cell import Site, emulated_world, installation
from tests.robocal.formats.calibrated_arms import calibrated_arm
from tests.service.released_arm import content_of

pytestmark = pytest.mark.skipif(
    not CHROMIUM, reason="no browser; install one: apt-get install chromium"
)


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with sync_playwright() as driver:
        started = driver.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield started
        started.close()


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Iterator[Site]:
    with installation(tmp_path_factory.mktemp("views")) as running:
        yield running


def ground(page: Page) -> str:
    return page.evaluate("getComputedStyle(document.body).backgroundColor")


def test_language_and_colours_are_kept_by_the_browser(chromium, place):
    with watched(chromium, place) as seen:
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
    chromium, place, tmp_path
):
    with emulated_world(tmp_path, time_scale=5) as world, watched(chromium, place) as anna:
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
        with chromium.new_context() as context:
            context.add_cookies([place.login_cookie("otto", "operate")])
            otto = Watched(context.new_page(), place)
            otto.open(f"/campaigns/{number}")
            for one in (page, otto.page):
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


def test_an_engineer_releases_a_version_and_an_operator_cannot(chromium, place):
    body = {"model": "ur10e", "driver": "mock", "address": "127.0.0.1:9"}
    tracker = {"driver": "mock", "address": "127.0.0.1:9"}
    place.post("/cells", {"name": "life", "robot": body, "tracker": tracker})
    place.post("/cells/life/arm")
    number = place.start_campaign(40, "life")
    database = open_database(place.database_url)
    with database.write() as session:
        store.add_candidate(session, "life", number, content_of(calibrated_arm("ur10e"), number))
    database.close()
    released_by_anna = re.compile("person anna.*commissioning", re.DOTALL)
    with watched(chromium, place) as seen:
        page = seen.page
        seen.open("/cells/life")
        page.get_by_role("button", name="Release").click()
        page.get_by_role("dialog").get_by_role("button", name="Release").click()
        expect(page.locator("#decision")).to_contain_text("not verified")
        seen.errors.clear()
        page.get_by_label("Reason").fill("commissioning")
        page.get_by_role("button", name="Release").click()
        page.get_by_role("dialog").get_by_role("button", name="Release").click()
        expect(page.locator("#versions .badge")).to_have_text("Released", timeout=PATIENCE_MS)
        expect(page.locator("#history")).to_contain_text(released_by_anna)
        seen.require_clean()
    place.post(f"/campaigns/{number}/abort")
