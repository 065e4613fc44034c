"""The page of a base calibration in a real browser, on an emulated stage between two robots."""

import os
from contextlib import closing
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from service.emulated_stage import EmulatedStage, StageHands
from tests.acceptance.test_page import (
    PATIENCE_MS,
    ROOT,
    Watched,
    watched,
)
from tests.integration.service_cell import Site, installation
from tests.integration.stage_hands import placed

SCREENSHOT = ROOT / "docs" / "images" / "base_calibration.png"
TOUCHES = 7


@pytest.fixture(scope="module")
def stage():
    with EmulatedStage(5) as addresses:
        yield addresses


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    with installation(tmp_path_factory.mktemp("site"), workers=0) as running:
        yield running


def fill(page: Page, request: dict) -> None:
    """Type a request into the form, whose fields are named as its places."""
    form = page.locator("#new-base-calibration")

    def put(path: str, value: object) -> None:
        if isinstance(value, dict):
            for name, part in value.items():
                put(f"{path}.{name}" if path else name, part)
        elif isinstance(value, list):
            for index, part in enumerate(value):
                put(f"{path}.{index}", part)
        else:
            field = form.locator(f'[name="{path}"]')
            if field.evaluate("node => node.tagName") == "SELECT":
                field.select_option(str(value))
            else:
                field.fill(str(value))

    put("", request)
    form.get_by_role("button", name="Start").click()


def take_next(seen: Watched, site: Site, hands: StageHands, number: int) -> None:
    """Do what the page asks for, as a person would."""
    shown = site.get(f"/base-calibrations/{number}").json()
    wanted = shown["next_touch"]
    assert hands.touch(wanted["robot"], wanted["cup"], **placed(wanted))["ok"]
    words = seen.page.locator("#next-words")
    asked = f"The {wanted['robot']} touches the {wanted['cup']} cup"
    expect(words).to_contain_text(asked, timeout=PATIENCE_MS)
    take = seen.page.get_by_role("button", name="Take touch")
    take.click()
    told = f"Touch {len(shown['touches']) + 1} was taken."
    expect(seen.page.locator("#notice")).to_have_text(told, timeout=PATIENCE_MS)
    expect(take).to_be_enabled(timeout=PATIENCE_MS)


def keep_picture(seen: Watched, tmp_path: Path) -> None:
    """Ordinary runs leave the documents as they are."""
    wanted = os.environ.get("ROBOCAL_SCREENSHOTS") == "1"
    path = SCREENSHOT if wanted else tmp_path / SCREENSHOT.name
    seen.page.screenshot(path=path, full_page=True, animations="disabled")


def test_an_operator_is_led_from_the_form_to_the_released_transform(
    browser,
    site,
    stage,
    tmp_path,
):
    with watched(browser, site) as seen, closing(StageHands(stage.stage_world)) as hands:
        page = seen.page
        seen.open("/")
        page.get_by_role("link", name="Base calibrations").click()
        fill(page, stage.request("line-1"))
        page.wait_for_url("**/base-calibrations/1")
        page.locator("html[data-ready]").wait_for()
        for _ in range(TOUCHES):
            take_next(seen, site, hands, 1)
        expect(page.locator(".sensor .lamp.steady")).to_have_count(3)
        expect(page.locator("#so-far tbody tr")).to_have_count(6)
        expect(page.locator("#so-far .caution")).to_have_count(0)
        page.locator("#touches").get_by_role("button", name="Void").last.click()
        page.get_by_label("Reason", exact=True).fill("tried out")
        page.get_by_role("dialog").get_by_role("button", name="Void").click()
        voided = page.locator("#touches tr.voided")
        expect(voided).to_contain_text("Voided: tried out", timeout=PATIENCE_MS)
        expect(page.locator("#touches tbody tr")).to_have_count(TOUCHES)
        take_next(seen, site, hands, 1)
        keep_picture(seen, tmp_path)
        page.get_by_role("button", name="Finish").click()
        page.get_by_role("dialog").get_by_role("button", name="Finish").click()
        expect(page.locator("#notice")).to_contain_text(
            "candidate, not yet in use", timeout=PATIENCE_MS
        )
        page.get_by_role("button", name="Release").click()
        page.get_by_role("dialog").get_by_role("button", name="Release").click()
        expect(page.locator("#notice")).to_have_text(
            "Version 1 of “line-1”: released.", timeout=PATIENCE_MS
        )
        assert site.get("/base-transforms/line-1").json()["version"] == 1
        seen.require_clean()
