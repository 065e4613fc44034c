"""What an operator's hand meets on the first page: pointer, keyboard, and a refresh in between."""

import json
from collections.abc import Iterator

import pytest
from playwright.sync_api import Locator, expect

from tests.acceptance.test_page import Watched, watched
from tests.integration.service_cell import Site, World, emulated_world, installation

NOWHERE = "127.0.0.1:9"
TABLET = {"width": 820, "height": 1180}


@pytest.fixture(scope="module")
def world(tmp_path_factory) -> Iterator[World]:
    with emulated_world(tmp_path_factory.mktemp("world")) as running:
        yield running


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Iterator[Site]:
    with installation(tmp_path_factory.mktemp("operator"), workers=0) as running:
        yield running


def make_cell(place: Site, name: str, address: str, **more: object) -> None:
    device = {"driver": "mock", "address": address}
    body = {"name": name, "robot": {"model": "ur10e", **device}, "tracker": device, **more}
    assert place.post("/cells", body).status_code == 201


def press_and_release(seen: Watched, button: Locator) -> None:
    """As a hand does: the page may move what is under the pointer in between."""
    button.scroll_into_view_if_needed()
    box = button.bounding_box()
    seen.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] - 2)
    seen.page.mouse.down()
    seen.page.evaluate("new Promise(done => requestAnimationFrame(() => setTimeout(done)))")
    seen.page.mouse.up()


def test_the_first_click_on_start_counts_though_it_leaves_a_field(browser, place):
    make_cell(place, "clicked", NOWHERE)
    with watched(browser, place) as seen:
        page = seen.page
        page.set_viewport_size(TABLET)
        seen.open()
        form = page.locator("#new-campaign")
        form.get_by_label("Cell").select_option("clicked")
        form.get_by_label("Kind").select_option("calibrate")
        # Typed, for a browser tells of a change only when such a field is left.
        form.get_by_label("Poses").press("Control+a")
        page.keyboard.type("24")
        note = page.locator("#campaign-poses-note")
        expect(note).to_have_text("Enough for the ur10e.")
        page.locator("#plan[data-poses='24']").wait_for()
        with page.expect_request(lambda request: request.method == "POST") as posted:
            press_and_release(seen, form.get_by_role("button", name="Start campaign"))
        assert json.loads(posted.value.post_data)["poses"] == 24
        expect(form.get_by_role("alert")).to_contain_text("is not armed")
        expect(note).to_have_text("Enough for the ur10e.")


def test_a_note_that_comes_or_goes_moves_nothing_below_it(browser, place):
    make_cell(place, "quiet", NOWHERE)
    with watched(browser, place) as seen:
        page = seen.page
        page.set_viewport_size(TABLET)
        seen.open()
        form = page.locator("#new-campaign")
        height = form.evaluate("form => form.offsetHeight")
        form.get_by_label("Kind").select_option("calibrate")
        form.get_by_label("Cell").select_option("quiet")
        expect(page.locator("#campaign-cell-note")).to_contain_text("is disarmed")
        form.get_by_label("Poses").fill("3")
        expect(page.locator("#campaign-poses-note")).to_contain_text("Too few")
        assert form.evaluate("form => form.offsetHeight") == height
        # What the browser itself says of the field goes with its fault.
        form.get_by_label("Poses").fill("")
        expect(page.locator("#campaign-poses-note.bad")).not_to_have_text("")
        form.get_by_label("Poses").fill("24")
        expect(page.locator("#campaign-poses-note.good")).to_contain_text("Enough")
        assert form.evaluate("form => form.offsetHeight") == height


def test_the_connection_test_names_every_device_and_outlives_a_refresh(browser, place, world):
    probe = {"driver": "mock", "address": NOWHERE}
    slide = {"name": "slide", "driver": "mock", "address": NOWHERE}
    make_cell(place, "tested", world.address, temperature_probe=probe, stage_sensors=[slide])
    told = place.post("/cells/tested/check").json()
    with watched(browser, place) as seen:
        page = seen.page
        seen.open()
        card = page.locator("[data-cell=tested]")
        with page.expect_response("**/parts/cells"):
            card.get_by_role("button", name="Test connection").click()
            lines = card.locator(".notice.bad li")
            expect(lines).to_have_count(4)
        expect(card.locator(".notice li.good")).to_have_text([
            "Robot: 6 joints, safety state normal",
            "Tracker: ready",
        ])
        faults = [told["temperature_probe"]["detail"], told["stage_sensors"]["slide"]["detail"]]
        expect(card.locator(".notice li.bad")).to_have_text([
            f"Temperature probe, fault: {faults[0]}",
            f"slide, fault: {faults[1]}",
        ])
        # Another person's cell makes the list new.
        make_cell(place, "later", NOWHERE)
        page.locator("[data-cell=later]").wait_for()
        expect(lines).to_have_count(4)
        seen.require_clean()


def test_what_is_there_when_the_page_opens_is_not_replaced_by_the_same(browser, place):
    make_cell(place, "same", NOWHERE)
    with watched(browser, place) as seen:
        page = seen.page
        seen.open()
        page.evaluate("""() => {
            window.replaced = 0;
            for (const part of document.querySelectorAll("[data-part]"))
                part.addEventListener("refreshed", () => window.replaced++);
        }""")
        for part in ("cells", "campaigns"):
            with page.expect_response(f"**/parts/{part}") as answer:
                pass
            answer.value.finished()
        with page.expect_response("**/parts/cells"):
            pass
        assert page.evaluate("window.replaced") == 0


def test_the_focus_stays_on_the_button_through_arm_and_disarm(browser, place):
    make_cell(place, "keys", NOWHERE)
    with watched(browser, place) as seen:
        page = seen.page
        seen.open()
        button = page.locator("#arm-keys")
        button.focus()
        page.keyboard.press("Enter")
        page.locator("#confirm-yes").wait_for()
        page.locator("#confirm-yes").focus()
        page.keyboard.press("Enter")
        page.locator("[data-cell=keys] .lamp.armed").wait_for()
        expect(button).to_be_focused()
        page.keyboard.press("Enter")
        page.locator("[data-cell=keys] .lamp:not(.armed)").wait_for()
        expect(button).to_be_focused()
        seen.require_clean()
